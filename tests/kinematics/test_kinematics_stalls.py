"""Machines whose joints are not the tool's axes, while sides of the firmware stall: judged by the step edges alone.

A stop that no one asked for stays on the programmed path of the tool, joints keep their limits, and the end is exact.
"""

from __future__ import annotations

import random

import numpy as np
import pytest
import stalls
from kinematics_core import COREXY, POLAR, SCARA, Machine
from motion_host import Host, Run
from test_kinematics_motion import ACCEL, DEVIATION_MM, RATE_MM_MIN, SPM, distance_to_segments, host_of, step_mm

KINDS = {"corexy": COREXY, "polar": POLAR, "scara": SCARA}
LINES = [(60, -50), (30, -40), (60, -50), (-20, 70), (30, 60), (60, 20), (60, -50)]
WINDOW_S = 0.010


def prepared(kind: int, **more: float) -> Host:
    host = host_of(kind, **more)
    host.run("G90G21\nG0X60Y-50\nG4P0.1\n")
    return host


def stalled(name: str, rng: random.Random, late: str, **more: float) -> tuple[Host, Machine]:
    """A controller at (60, -50) whose sides stall from now on, and its geometry. @param more  settings"""
    kind = KINDS[name]
    host = prepared(kind, **more)
    host.stall_often(rng, stalls.LATE[late], 60)
    return host, Machine(kind, (60, 50))


def joints_of(run: Run) -> np.ndarray:
    """Place of X and Y joints after each step event, mm or degrees."""
    steps = run.positions()[:, :2]
    return (steps - steps[-1] + np.array(run.position[:2])) / SPM


def assert_legal(run: Run) -> None:
    """Rate and acceleration of every joint."""
    t, joints = run.seconds(), joints_of(run)
    grid = np.arange(t[0] - 3 * WINDOW_S, t[-1] + 3 * WINDOW_S, 0.001)
    n = round(WINDOW_S / 0.001)
    for joint in range(2):
        at = np.interp(grid, t, joints[:, joint])
        speed = (at[n:] - at[:-n]) / WINDOW_S
        change = (speed[n:] - speed[:-n]) / WINDOW_S
        assert np.abs(speed).max() <= RATE_MM_MIN / 60 * 1.01 + 1 / SPM / WINDOW_S
        assert np.abs(change).max() <= 1.2 * ACCEL + 2 / SPM / WINDOW_S**2


def assert_on_lines(machine: Machine, run: Run, corners: list[tuple[int, int]]) -> None:
    off = distance_to_segments(machine.tool_mm(joints_of(run)), np.array(corners, dtype=float))
    assert off.max() <= DEVIATION_MM + step_mm(machine.kind, 90)


def assert_ends_at(machine: Machine, run: Run, place: tuple[int, int]) -> None:
    assert machine.tool_mm(joints_of(run))[-1] == pytest.approx(place, abs=step_mm(machine.kind, 90))


@pytest.mark.alike(8)
@pytest.mark.parametrize("jerk", [0, 30_000])
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", stalls.seeds(2))
def test_lines(seed: int, name: str, late: str, jerk: float) -> None:
    rng = random.Random(f"{seed} {name} {late} {jerk}")
    host, machine = stalled(name, rng, late, s40=jerk)
    feed = rng.choice([600, 3000, 6000])
    run = host.run(f"G1F{feed}\n" + "".join(f"X{x}Y{y}\n" for x, y in LINES))
    host.close()
    assert set(run.answers) == {"ok"}
    assert_on_lines(machine, run, [(60, -50), *LINES])
    assert_ends_at(machine, run, (60, -50))
    assert_legal(run)


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", stalls.seeds(2))
def test_circles_and_rapids(seed: int, name: str, late: str) -> None:
    """A circle of 10 mm about (60, -40), in both directions."""
    rng = random.Random(f"{seed} {name} {late}")
    host, machine = stalled(name, rng, late)
    run = host.run("G2X60Y-50I0J10F3000\nG3X60Y-50I0J10\nM3S100\nG1X60Y-30F6000\nM5\n")
    host.close()
    tool = machine.tool_mm(joints_of(run))
    circle = np.abs(np.hypot(tool[:, 0] - 60, tool[:, 1] + 40) - 10)
    line = distance_to_segments(tool, np.array([(60, -50), (60, -30)], dtype=float))
    assert np.minimum(circle, line).max() <= DEVIATION_MM + 0.002 + step_mm(machine.kind, 90)
    assert_ends_at(machine, run, (60, -30))
    assert_legal(run)


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", stalls.seeds(3))
def test_a_jog_is_cancelled_on_its_line(seed: int, name: str, late: str) -> None:
    rng = random.Random(f"{seed} {name} {late}")
    host, machine = stalled(name, rng, late)
    host.start("$J=G90X30Y-80F5000\n$J=G90X60Y-50F5000\n")
    host.until(host.ticks() + round(rng.uniform(0.05, 1.0) * host.timer_hz))
    host.put("\x85")
    run = host.settle()
    assert_on_lines(machine, run, [(60, -50), (30, -80)])
    assert_legal(run)
    assert "<Idle" in host.status()
    again = host.run("G1X60Y-50F2000\n")
    host.close()
    assert_ends_at(machine, again, (60, -50))


@pytest.mark.alike(8)
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", stalls.seeds(3))
def test_a_hold_and_overrides_stay_on_the_path(seed: int, name: str, late: str) -> None:
    rng = random.Random(f"{seed} {name} {late}")
    host, machine = stalled(name, rng, late)
    host.start("G1F5000\n" + "".join(f"X{x}Y{y}\n" for x, y in LINES))
    for _ in range(12):
        host.until(host.ticks() + round(rng.uniform(0.01, 0.6) * host.timer_hz))
        host.put(rng.choice(["!", "~", "!~", "\x91", "\x92", "\x90"]))
    host.until(host.ticks() + host.timer_hz)
    host.put("~")
    run = host.settle()
    host.put("~")
    run = host.settle()
    host.close()
    assert_ends_at(machine, run, (60, -50))
    assert_on_lines(machine, run, [(60, -50), *LINES])
    assert_legal(run)
