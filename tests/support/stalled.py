"""A text controller whose sides stall (stalls.py): what the tests of homing, jobs and probes have in common."""

from __future__ import annotations

import re

import numpy as np
from grbl_host import Grbl
from numpy.typing import NDArray

SPM, ACCEL = 250, 500  # of three axes
COMMITTED_S = 0.055  # AHEAD_FULL_US, and a segment
ANSWER = re.compile(r"^(?:ok|error:\d+)\r$", re.MULTILINE)


# Settings that smooth motion: none, limited jerk, input shapers, both.
SMOOTH: tuple[dict[str, float], ...] = (
    {},
    {"s40": 30_000},
    {"s170": 1, "s180": 40, "s171": 2, "s181": 25},
    {"s40": 60_000, "s170": 3, "s180": 60},
)


def recorded(**more: float) -> Grbl:
    """A machine at rest, whose steps are kept. @param more  settings, as s10=1"""
    grbl = Grbl()
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": v for base, v in ((100, SPM), (110, 5000), (120, ACCEL)) for ax in range(3)})
    grbl.settings(s10=1, **more)
    grbl.record()
    return grbl


def until_answered(grbl: Grbl, text: str, lines: int = 1, most_s: float = 300, look_s: float = 0.05) -> str:
    """Write it, and wait until so many lines are answered. Returns what was answered."""
    said, end_s = grbl.after(0.0, text), grbl.time() + most_s
    while len(ANSWER.findall(said)) < lines:
        assert grbl.time() < end_s, f"hangs: {said}"
        said += grbl.after(look_s)
    return said


def ways(grbl: Grbl) -> tuple[NDArray[np.uint64], NDArray[np.int64]]:
    """Ticks of all step events, and the place of X, Y and Z after each."""
    events = grbl.step_events()
    bits = np.arange(3)
    sense = 1 - 2 * (events["dir"][:, None] >> bits & 1).astype(int)
    return events["t"], np.cumsum((events["step"][:, None] >> bits & 1) * sense, axis=0)


def stop_steps(speed: float, accel: float = ACCEL * SPM) -> float:
    """How far it continues at the most after what stops it, from so many steps/s: what is committed, and a ramp."""
    return speed * COMMITTED_S + speed**2 / (2 * accel) + 2


def assert_accelerations(grbl: Grbl, accel: float = ACCEL * SPM) -> None:
    """Of all steps, in steps/s2."""
    assert np.abs(grbl.accelerations()).max() <= 1.2 * accel + 2 / 0.01**2


def assert_legal(grbl: Grbl) -> None:
    """The limits are kept, and the counters are the pulses."""
    assert_accelerations(grbl)
    assert grbl.position() == grbl.stands()
