"""Motion that follows the spindle, while sides of the firmware stall.

It stays within the limits, and comes to the end of the pass or to an alarm; the position is that of the pulses."""

from __future__ import annotations

import random

import numpy as np
import pytest
import stalls
from grbl_host import HZ
from lathe import ACCEL_MM_S2, INDEX_REV, STEPS_MM, Lathe
from numpy.typing import NDArray

PASSES = ["G33Z-4K0.5", "G33Z-30K2", "G33X3Z-12K1", "G33.1Z-8K1", "G76P1Z-12I-1J0.3K0.6"]


def lathe_of(late: str, rng: random.Random, jerk_mm_s3: float) -> Lathe:
    lathe = Lathe()
    lathe.settings(s40=jerk_mm_s3)
    lathe.fine("G18", "G0X12Z0", f"M3S{rng.choice([120, 300, 600])}")
    lathe.record()
    lathe.after(2)
    lathe.stall_often(rng, stalls.LATE[late], rng.choice([2, 5, 30]))
    return lathe


def assert_legal(lathe: Lathe) -> None:
    assert np.abs(lathe.accelerations()).max() <= 1.2 * ACCEL_MM_S2 * STEPS_MM + 4 / 0.01**2
    assert lathe.position() == lathe.stands()


def course(lathe: Lathe, pitch_mm: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of every step: its time, how far Z was then, and how far from the thread's line, revolutions."""
    events = lathe.step_events()
    down = np.where(events["dir"] >> 2 & 1, 1, -1) * (events["step"] >> 2 & 1).astype(int)
    t, z_mm = events["t"] / HZ, np.cumsum(down) / STEPS_MM
    rev = lathe.spindle_angle() - (lathe.time() - t) * lathe.spindle_rpm() / 60 - INDEX_REV
    return t, z_mm, (z_mm / pitch_mm - rev + 0.5) % 1 - 0.5


def off_rev(lathe: Lathe, line: str) -> float:
    """How far the tool was from the line of a straight thread, where it neither begins nor ends."""
    pitch_mm, way_mm = float(line.split("K")[1]), -float(line.split("Z")[1].split("K")[0])
    _, z_mm, off = course(lathe, pitch_mm)
    return float(np.abs(off[(z_mm > 0.3 * way_mm) & (z_mm < 0.7 * way_mm)]).max())


@pytest.mark.parametrize("jerk", [0, 30_000])
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("line", PASSES)
@pytest.mark.parametrize("seed", stalls.seeds(2))
def test_a_pass_is_made_whole_or_ends_in_an_alarm(seed: int, line: str, late: str, jerk: float) -> None:
    rng = random.Random(f"{seed} {line} {late} {jerk}")
    lathe = lathe_of(late, rng, jerk)
    said, end_s = lathe.after(0, line + "\n"), lathe.time() + 120
    while not any(word in said for word in ("ok\r\n", "error:")):
        assert lathe.time() < end_s, f"hangs: {said}"
        said += lathe.after(0.05)
    said += lathe.after(3)
    at = lathe.stands()
    if "ALARM" in said:
        assert any(alarm in said for alarm in ("ALARM:51", "ALARM:52")), said
    elif line.startswith("G33.1"):
        assert at[2] == 0
    elif line.startswith("G33"):
        assert at[2] == round(float(line.split("Z")[1].split("K")[0]) * STEPS_MM), said
        assert "X3" in line or off_rev(lathe, line) <= 0.1
    lathe.after(20)
    assert lathe.stands() == at, "nothing comes later"
    assert_legal(lathe)
    lathe.close()


@pytest.mark.parametrize("jerk", [0, 30_000])
@pytest.mark.parametrize("side", [stalls.Side.CONTROLLER, stalls.Side.MOTION])
def test_behind_a_stall_the_tool_is_on_its_line_again(side: stalls.Side, jerk: float) -> None:
    """Short ones, that the pass survives. The time in which limited jerk lets the axes come to rest counts, too."""
    lathe = Lathe()
    lathe.settings(s40=jerk)
    lathe.fine("G18", "G0X12Z0", "M3S120")
    lathe.record()
    lathe.after(2)
    said, stalled_at = lathe.after(2, "G33Z-12K1\n"), []
    for _ in range(3):
        lathe.stall(side, 0.0, 0.01)
        stalled_at.append(lathe.time())
        said += lathe.after(1)
    assert "ALARM" not in said + lathe.after(4) and lathe.stands()[2] == -12 * STEPS_MM
    t, _, off = course(lathe, 1.0)
    for at in stalled_at:
        assert np.abs(off[(t > at) & (t < at + 0.1)]).max() > 0.005, "it was off"
        assert np.abs(off[(t > at + 0.3) & (t < at + 0.9)]).max() <= 0.002
    lathe.close()


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("command", ["!", "\x84", "\x18"])
@pytest.mark.parametrize("seed", stalls.seeds(2))
def test_a_hold_waits_for_the_end_of_the_pass(seed: int, command: str, late: str) -> None:
    rng = random.Random(f"{seed} {command} {late}")
    lathe = lathe_of(late, rng, 0)
    said = lathe.after(rng.uniform(0.05, 4), "G33Z-10K1\n")
    said += lathe.after(20, command)
    at = lathe.stands()
    said += lathe.after(10, "~")
    if command == "\x18":
        assert lathe.stands() == at
    elif "ALARM" not in said:
        said += lathe.after(40)
        assert lathe.stands()[2] == -10 * STEPS_MM and "ok" in said
    assert lathe.position() == lathe.stands()
    lathe.close()
