"""Lines as long as a program may ask for: their ends, and what comes after them, are as lawful as any.

A place along a line is a sum of floats, and their rounding grows with its length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from lawful import ALLOWED, WINDOWS_S, Machine, derivatives, grain_mm_s2
from motion_host import Run
from slow import cases_but

MOST_MM = 100_000.0  # from zero: GCODE_COORDINATE_MAX
LARGE = Machine(steps_per_mm=(250.0,) * 3, rate_mm_min=(12_000.0,) * 3, deviation_mm=0.02)
# Steps so fine that two of them are no more than 0.2 of its acceleration over 10 ms.
SLOW = replace(LARGE, steps_per_mm=(2000.0,) * 3, accel_mm_s2=(50.0,) * 3)
KINDS = {
    "plain": LARGE,
    "jerk": replace(LARGE, jerk_mm_s3=20_000.0),
    "shaper": replace(LARGE, shapers=((1, 40.0, 0.1),) * 3),
    "slow": SLOW,
    "stops": replace(LARGE, deviation_mm=0.0),
    "slow stops": replace(SLOW, deviation_mm=0.0),
    "fine": replace(LARGE, steps_per_mm=(800.0,) * 3),
}
# After a line with this direction; in G91.
X, Y = 50.0 / 68.282, 46.5 / 68.282
NEXT = {
    "flat arc": "G3 X.7257 Y.6693 R3729.167 F9000\nG1 X800 Z-3\n",
    "straight on": "G1 X40 Y37.2 F9000\n",
    "bend": "G1 X40 Y36 F9000\n",
    "corner": "G1 X-27.9 Y30 F9000\n",
    "back": "G1 X-30 Y-27.9 F9000\n",
    "almost back": "G1 X-30 Y-27 F9000\n",
    "plunge": "G1 Z-30 F9000\n",
    "circle": "G2 X0 Y0 I10 J-10 F9000\nG1 X3\n",
    "chords": "G1 F6000\n" + "".join(f"X.3 Y{0.3 + 0.02 * k:.2f} Z{0.01 * k:.2f}\n" for k in range(60)),
}
LENGTHS_MM = (1_000.0, 4_200.0, 10_000.0, 30_000.0, 68_282.0, 134_000.0)
OFTEN = (
    ("flat arc", 68_282.0, "plain"),
    ("flat arc", 30_000.0, "slow"),
    ("bend", 134_000.0, "shaper"),
    ("back", 10_000.0, "stops"),
    ("almost back", 4_200.0, "slow stops"),
    ("chords", 30_000.0, "slow"),
    ("circle", 68_282.0, "jerk"),
    ("corner", 30_000.0, "fine"),
    ("plunge", 1_000.0, "stops"),
    ("straight on", 68_282.0, "stops"),
)


def performed(machine: Machine, program: str, **settings: float) -> Run:
    """Its last steps alone: all of them are too many to keep."""
    host = machine.host()
    host.settings(**settings)
    host.steps.keep_events = 400_000
    run = host.run(program)
    host.close()
    assert run.answers == ["ok"] * program.count("\n")
    return run


def assert_last_steps_are_lawful(run: Run, machine: Machine) -> None:
    """Over each window in which steps are fine enough, but for the first ones: what was before is not known."""
    assert run.counters.plan_unmet == 0
    for window_s, allowed in zip(WINDOWS_S, ALLOWED, strict=True):
        two_steps = 2.0 / (np.array(machine.steps_per_mm) * window_s**2)
        if (two_steps > 0.7 * np.array(machine.accel_mm_s2)).any():
            continue
        speed, accel = derivatives(run.seconds(), run.positions(), machine, window_s)
        grain = grain_mm_s2(speed, machine, window_s)
        found = (np.abs(accel) - grain)[80:] / machine.accel_mm_s2  # 8 windows
        assert found.max() <= allowed, f"{found.max():.3f} x in {1e3 * window_s:.0f} ms"


@pytest.mark.parametrize(("name", "length_mm", "kind"), cases_but(lambda *case: case in OFTEN, NEXT, LENGTHS_MM, KINDS))
def test_no_axis_exceeds_its_acceleration_after_a_long_line(name: str, length_mm: float, kind: str) -> None:
    machine = KINDS[kind]
    run = performed(machine, f"G0 X{length_mm * X:.3f} Y{length_mm * Y:.3f}\nG91\n{NEXT[name]}")
    assert_last_steps_are_lawful(run, machine)


@pytest.mark.parametrize("length_mm", [30.0, 300.0, 1_000.0, 2_000.0, 3_000.0, 4_000.0])
def test_no_time_is_lost_at_a_place_of_rest(length_mm: float) -> None:
    """To and fro on X alone: between the last steps of a way and the first ones back it slows down and speeds up with
    one acceleration, whatever is left of the way before it counts as its end."""
    machine = replace(KINDS["slow stops"], steps_per_mm=(4000.0,) * 3, rate_mm_min=(9_000.0,) * 3)
    run = performed(machine, f"G0 X{length_mm:.0f}\nG0 X{length_mm - 20:.0f}\n")
    assert run.counters.plan_unmet == 0
    t_s, back = run.seconds(), run.events["dir"] & 1
    turn = int(np.flatnonzero(np.diff(back.astype(int)) > 0)[-1])
    places = np.arange(1, 40) + 0.5  # steps from the place of rest, where a step is due
    from_rest_s = np.sqrt(2 * places / machine.steps_per_mm[0] / machine.accel_mm_s2[0])
    rests_s, leaves_s = t_s[turn - 1 : turn - 40 : -1] + from_rest_s, t_s[turn + 2 : turn + 41] - from_rest_s
    assert np.abs(leaves_s - rests_s).max() <= 0.2e-3


def all_of_a_trapezoid_s(way_mm: float, machine: Machine) -> float:
    """Of all axes alike, at their rate."""
    v, a = machine.rate_mm_min[0] / 60, machine.accel_mm_s2[0]
    return way_mm / v + v / a


def test_the_longest_line_of_all() -> None:
    """From one end of the coordinates to the other."""
    machine = replace(LARGE, steps_per_mm=(100.0,) * 3)
    ends = [" ".join(f"{axis}{sign}{MOST_MM:.0f}" for axis in "XYZ") for sign in ("-", "")]
    run = performed(machine, f"G0 {ends[0]}\n{ends[1]}\n")
    assert run.position[:3] == [round(MOST_MM * 100)] * 3
    assert run.counters.blocks == 2  # each of its parts is none
    assert_last_steps_are_lawful(run, machine)
    both_s = all_of_a_trapezoid_s(MOST_MM, machine) + all_of_a_trapezoid_s(2 * MOST_MM, machine)
    assert run.end_ticks / run.timer_hz == pytest.approx(both_s, abs=0.1)


@pytest.mark.alike(5)
@pytest.mark.parametrize("kind", ["plain", "jerk", "stops"])
@pytest.mark.parametrize("length_mm", [4_000.0, 4_100.0, 50_000.0])
def test_a_long_line_takes_as_long_as_it_should(kind: str, length_mm: float) -> None:
    machine = KINDS[kind]
    host = machine.host()
    run = host.run(f"G0 X{length_mm:.0f}\n") if length_mm < 5_000 else performed(machine, f"G0 X{length_mm:.0f}\n")
    host.close()
    assert run.position[0] == length_mm * 250
    late_s = 0.06 if kind == "jerk" else 0.03  # to the first step; the mean of limited jerk
    took_s = run.seconds()[-1]
    assert (
        all_of_a_trapezoid_s(length_mm, machine) - 0.01 <= took_s <= all_of_a_trapezoid_s(length_mm, machine) + late_s
    )


def test_a_feed_per_inverse_time_counts_for_all_of_a_long_line() -> None:
    run = performed(LARGE, "G93\nG1 X5000 F1.2\nG1 X15000 F0.5\n")
    v1, v2 = 5000 / 50, 10000 / 120
    all_s = 50 + 120 + v1 / 500 / 2 + v2 / 500 / 2
    assert run.position[0] == 15000 * 250
    assert run.seconds()[-1] == pytest.approx(all_s, abs=0.05)


@pytest.mark.parametrize("kind", range(1, 4))
def test_long_lines_of_other_kinds_of_machines(kind: int) -> None:
    """Where the tool's axes are not the joints'."""
    targets: Sequence[tuple[float, float, float]] = [(9000.0, -3000.0, 20_000.0), (9000.0, -2950.0, 20_000.0)]
    arms = {"s81": 9_000.0, "s82": 6_000.0} if kind == 3 else {"s130": 10_000.0}
    program = "G0 X3000 Y0\n" + "".join(f"G1 X{x:g} Y{y:g} Z{z:g} F6000\n" for x, y, z in targets)
    machine = replace(LARGE, deviation_mm=0.05)
    run = performed(machine, program, s80=kind, **arms)
    assert run.counters.plan_unmet == 0
    assert math.isclose(run.position[2], 20_000 * 250)


def test_a_long_line_is_held_resumed_and_cancelled_like_any_other() -> None:
    host = LARGE.host()
    host.steps.keep_events = 400_000
    host.start("G0 X50000 Y46500\n")
    host.until(round(100.3 * host.timer_hz))
    host.put("!")
    held = host.settle()
    place = list(held.position)
    assert 0 < place[0] < 50_000 * 250
    assert "Hold:0" in host.status()
    host.put("~")
    assert host.settle().position[:2] == [50_000 * 250, 46_500 * 250]
    host.start("$J=G90X0Y0F12000\n")
    host.until(host.ticks() + 20 * host.timer_hz)
    host.put("\x85")
    cancelled = host.settle()
    assert 0 < cancelled.position[0] < 50_000 * 250
    assert host.run("G0 X50000 Y46500\n").position[:2] == [50_000 * 250, 46_500 * 250]
    host.close()
