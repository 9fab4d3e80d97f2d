"""Step pulses of a steady move are evenly spaced, whatever their rate has to do with the timer's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from wificnc.board.load import load_board
from wificnc.simulator.run import SimOptions, simulate

STEPS_PER_MM, RATE_MM_MIN, ACCEL = 5000, 5000, 500
SPEED_UP_S = RATE_MM_MIN / 60 / ACCEL


@pytest.mark.parametrize("board", ["host", "pic32mz2048efh100"])
@pytest.mark.parametrize("feed_mm_min", [1234.5, 2999, 4567, 5000])
def test_intervals_are_within_a_tick(tmp_path: Path, board: str, feed_mm_min: float) -> None:
    """At up to 416 kHz, where a tick of the step timer is 1 to 2 % of an interval; the tasks' rounds, the borders of
    segments and of batches do not show."""
    job, trace = tmp_path / "job.nc", tmp_path / "trace.csv"
    job.write_text(f"G21G91\nG1X30F{feed_mm_min}\n")
    settings = (f"$100={STEPS_PER_MM}", f"$110={RATE_MM_MIN}", f"$120={ACCEL}")
    simulate(SimOptions(file=job, board=board, settings=settings, trace=trace))
    t_ns = np.loadtxt(trace, delimiter=",", skiprows=1, dtype=np.int64)[:, 0]
    timing = load_board(board).timing
    asked_ns = 60e9 / (feed_mm_min * STEPS_PER_MM)
    period_ns = max(asked_ns, 1e9 / timing.max_step_rate_hz)
    steady = t_ns[(t_ns > t_ns[0] + SPEED_UP_S * 1e9) & (t_ns < t_ns[-1] - SPEED_UP_S * 1e9)]
    tick_ns = 1e9 / timing.timer_hz
    off_ns = np.abs(np.diff(steady) - period_ns)
    assert len(steady) > 10_000
    assert off_ns.max() <= 1.05 * tick_ns
