"""Times from the simulator."""

from __future__ import annotations

from patience import HANG_S
from wificnc.build.host import ensure_host_library
from wificnc.job.program import read_program
from wificnc.simulator.estimate import Estimate
from wificnc.simulator.library import load_library

SETTINGS = {110: "6000", 111: "6000", 112: "6000", 120: "1000", 121: "1000", 122: "1000"}


def estimate(text: str) -> Estimate:
    lines = read_program("job.nc", text.encode()).lines
    found = Estimate(load_library(ensure_host_library()), lines, SETTINGS, 3)
    assert found.wait(HANG_S)
    return found


def test_time_left_falls_to_nothing() -> None:
    moves = "".join(f"G1 X{i % 2 * 100} F6000\n" for i in range(400))
    times = estimate("G21 G90\n" + moves)
    assert times.total_s is not None
    assert abs(times.total_s - 399 * 1.1) < 1.0  # 100 mm at 100 mm/s, and a tenth of a second to come up to it
    left = [times.remaining_s(answered) or 0.0 for answered in range(402)]
    assert left == sorted(left, reverse=True)
    assert left[0] == times.total_s
    assert 220 < left[-1] < 280  # the last moves are in the look-ahead when the last answer comes
    assert times.remaining_s(401, since_s=1000.0) == 0.0
    assert left[100] >= (times.remaining_s(100, since_s=1000.0) or 0.0) >= left[101]


def test_dwell_and_pause() -> None:
    total = estimate("G4 P5\nM0\nG4 P2\n").total_s
    assert total is not None
    assert abs(total - 7.0) < 0.1


def test_a_wrong_line_does_not_end_it() -> None:
    total = estimate("G4 P1\nG1 X1\nG77\nG4 P1\n").total_s
    assert total is not None
    assert abs(total - 2.0) < 0.1
