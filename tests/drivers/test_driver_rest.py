"""With motor drivers a controller at rest looks at them at its own times, and a simulated one sleeps in between."""

from __future__ import annotations

import pytest
from c_library import LIB
from driver_grbl import KINDS, DriverGrbl
from grbl_host import HZ
from wificnc.simulator.library import Tasks

REST_S = 0.1
# A look each ms; of each bus its answers' ends besides, from which a driver that was looked at is taken as fine.
MOST_GOES = 4 * round(REST_S * 1000)


@pytest.mark.parametrize("tasks", [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ])
@pytest.mark.parametrize("kind", KINDS)
def test_a_go_leads_to_something_that_happens(kind: int, tasks: Tasks) -> None:
    grbl = DriverGrbl(kind, tasks=tasks)
    try:
        grbl.set_up()
        end = LIB.host_time_ticks(grbl._host) + round(REST_S * HZ)
        datagrams, goes = grbl.datagrams(), 0
        while LIB.host_time_ticks(grbl._host) < end and goes <= MOST_GOES:
            LIB.host_run_until(grbl._host, min(LIB.host_next_ticks(grbl._host), end))
            goes += 1
        assert goes <= MOST_GOES
        assert grbl.datagrams() > datagrams
    finally:
        grbl.close()
