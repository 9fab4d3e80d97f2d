"""Step edges in time: a feed is exact however its step interval falls between two ticks of the timer, and the edge of a
switch stops the steps by itself."""

from __future__ import annotations

import numpy as np
import pytest
from grbl_host import HZ, Grbl
from stalls import Side

STEPS_PER_MM = 250


@pytest.mark.parametrize("feed_mm_min", [5999.3, 4321.7, 3777.1, 2999.3, 1234.5])
def test_the_fractions_of_a_tick_add_up_to_the_feed(grbl: Grbl, feed_mm_min: float) -> None:
    """In the cruise of a long move the mean step interval is that of F within 10 ppm; half a tick is more."""
    grbl.fine("$110=9000", "$120=500")
    grbl.record()
    grbl.send(f"G91G1X60F{feed_mm_min}\n")
    edges = grbl.step_events()["t"].astype(np.int64)
    assert len(edges) == 60 * STEPS_PER_MM
    cruise = edges[len(edges) // 4 : -len(edges) // 4]
    interval_ticks = HZ * 60 / (feed_mm_min * STEPS_PER_MM)
    mean = (cruise[-1] - cruise[0]) / (len(cruise) - 1)
    assert mean / interval_ticks == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("stalled", [Side.CONTROLLER, Side.MOTION])
@pytest.mark.parametrize(("switch", "alarm"), [("estop", 50), ("limit-max-y", 1)])
@pytest.mark.parametrize("at_s", [0.013, 0.2, 0.4003])
def test_the_edge_of_a_switch_needs_no_task_to_stop_the_steps(
    grbl: Grbl, stalled: Side, switch: str, alarm: int, at_s: float
) -> None:
    """A task that is late by 0.5 s: not one step leaves the pins after the edge."""
    grbl.fine("$21=1", "$92=0", "$110=9000")
    grbl.after(0.3, "G91G1X-60F3000\n")
    grbl.stall(stalled, after_s=at_s - 0.001, for_s=0.5)
    grbl.input_in(at_s, switch, True)
    said = grbl.after(at_s + 1e-6)
    at = grbl.stands()
    said += grbl.after(0.4)
    assert grbl.stands() == at and grbl.position() == at
    assert f"ALARM:{alarm}" in said + grbl.after(1) and grbl.stands() == at == grbl.position()
    grbl.input(switch, False)


def test_a_switch_that_is_no_stop_lets_the_steps_go_on(grbl: Grbl) -> None:
    """The limits without $21: their edges do not even touch the motion."""
    grbl.fine("$21=0", "$110=9000")
    grbl.after(0.3, "G91G1X-20F3000\n")
    grbl.input("limit-max-y", True)
    grbl.send("")
    assert grbl.stands()[0] == -20 * STEPS_PER_MM and grbl.state() == "Idle"
    grbl.input("limit-max-y", False)
