"""Tasks that are late: the step ISR always moves the machine within its limits, and the job continues by itself.

The task side plans, the motion side cuts spans; while the flash is written neither runs. Seen from the step edges:
no axis exceeds its acceleration, the path is the same, the end is exact, every line is answered."""

from __future__ import annotations

import math
import random
from functools import cache

import numpy as np
import pytest
from motion_host import BASELINE, Host, Run
from numpy.typing import NDArray
from slow import slow_but
from wificnc.simulator.library import Tasks

ACCEL_MM_S2 = 500.0
STEPS_PER_MM = 250.0
WINDOW_S = 0.010
TASK, MOTION, BOTH = 1, 2, 3
SIDES = {"task": TASK, "motion": MOTION, "both": BOTH}

CIRCLE = [(20 * math.sin(a), 20 - 20 * math.cos(a)) for a in np.linspace(0, 2 * math.pi, 629)]
PROGRAMS: dict[str, str] = {
    "line": "G1 X300 F5000\n",
    "polygon": "G1 F4000 X40\nY40\nX0\nY0\nX30 Y20\nX0 Y0\n",
    "arc": "G2 X0 Y0 I0 J20 F4000\nG3 X0 Y0 I15 J0\n",
    "dense": "G1 F5000\n" + "".join(f"X{x:.4f}Y{y:.4f}\n" for x, y in CIRCLE[1:]),
    "rapids": "G0 X60 Y10\nZ5\nX0 Y0\nZ0\n",
    "stops": "G61 G1 F4000 X20\nY20\nX0\nY0\n",
}


def fresh(jerk_mm_s3: float = 0.0) -> Host:
    host = Host(axes=3)
    host.settings(
        **{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3},
        s11=0.01,
        s12=0.002,
        s40=jerk_mm_s3,
    )
    return host


def acceleration(run: Run) -> float:
    """The greatest of an axis: change of the mean speed from one window to the next, in windows that slide by 1 ms. One
    step of the staircase is not counted."""
    t, at = run.seconds(), run.positions()[:, :3] / STEPS_PER_MM
    if len(t) == 0:
        return 0.0
    grid = np.arange(t[0] - 3 * WINDOW_S, t[-1] + 3 * WINDOW_S, 0.001)
    place = np.stack([np.concatenate([[0.0], at[:, ax]])[np.searchsorted(t, grid, side="right")] for ax in range(3)], 1)
    n = round(WINDOW_S / 0.001)
    second = (place[2 * n :] - 2 * place[n:-n] + place[: -2 * n]) / WINDOW_S**2
    return float(np.abs(second).max()) - 2 / STEPS_PER_MM / WINDOW_S**2


def cells(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells of 3 steps in which these places are, in one number."""
    at = places // 3 + 2**20
    return (at[:, 0] << 42) + (at[:, 1] << 21) + at[:, 2]


def off_path(run: Run, plain: Run) -> int:
    """Places farther than two cells, 0.024 mm, off the path."""
    around = np.array([(x, y, z) for x in (-3, 0, 3) for y in (-3, 0, 3) for z in (-3, 0, 3)])
    path = plain.positions()[:, :3]
    near = np.unique(np.concatenate([cells(path + by) for by in around]))
    return int((~np.isin(cells(run.positions()[:, :3]), near)).sum())


def assert_legal(run: Run) -> None:
    assert run.counted() == run.position, "the counters are the pulses"
    assert acceleration(run) <= 1.2 * ACCEL_MM_S2


def run_with(program: str, stalls: list[tuple[int, float, float]], jerk_mm_s3: float = 0.0) -> Run:
    host = fresh(jerk_mm_s3)
    begin_s = host.ticks() / host.timer_hz
    for sides, from_s, for_s in stalls:
        host.stall_sides(sides, begin_s + from_s, for_s)
    run = host.run(program)
    host.close()
    return run


@cache
def undisturbed(program: str, jerk_mm_s3: float = 0.0) -> Run:
    """What it does without a stall; the same for many tests."""
    return run_with(program, [], jerk_mm_s3)


def random_stalls(rng: random.Random, sides: int, most_s: float) -> list[tuple[int, float, float]]:
    at_s, stalls = 0.0, []
    while len(stalls) < 40:
        at_s += rng.uniform(0.01, 0.4)
        for_s = math.exp(rng.uniform(math.log(0.001), math.log(most_s)))
        stalls.append((sides, at_s, for_s))
        at_s += for_s
    return stalls


@pytest.mark.alike(4)
@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("seed", slow_but((0).__eq__, range(2)))
def test_stalls_of_any_length_break_no_limit_and_lose_nothing(name: str, side: str, seed: int) -> None:
    plain = undisturbed(PROGRAMS[name])
    run = run_with(PROGRAMS[name], random_stalls(random.Random(f"{name} {side} {seed}"), SIDES[side], 1.0))
    assert_legal(run)
    assert run.position == plain.position
    assert run.answers == plain.answers
    assert off_path(run, plain) == 0


@pytest.mark.parametrize("name", ["polygon", "arc", "dense"])
@pytest.mark.parametrize("side", SIDES)
def test_a_limited_jerk_rolls_back_too(name: str, side: str) -> None:
    plain = undisturbed(PROGRAMS[name], 30_000)
    run = run_with(PROGRAMS[name], random_stalls(random.Random(f"{name} {side}"), SIDES[side], 0.5), 30_000)
    assert_legal(run)
    assert run.position == plain.position


@pytest.mark.parametrize("stall_s", [0.010, 0.020])
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", ["line", "polygon", "arc", "dense"])
def test_ordinary_stalls_do_not_even_slow_the_job(name: str, side: str, stall_s: float) -> None:
    """10 or 20 ms in each 100 ms: less than what is committed."""
    plain = undisturbed(PROGRAMS[name])
    run = run_with(PROGRAMS[name], [(SIDES[side], 0.1 * n, stall_s) for n in range(1, 200)])
    assert_legal(run)
    assert run.position == plain.position
    assert run.counters.underruns == 0
    took_s, plain_s = (float(np.ptp(r.seconds())) for r in (run, plain))
    assert took_s <= plain_s + 0.03


@pytest.mark.parametrize("tasks", [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ])
@pytest.mark.parametrize(("accel", "feed", "jerk"), [(10, 5000, 0), (2, 600, 0), (1, 600, 0), (500, 3000, 100)])
def test_a_stop_that_takes_long_is_ready_too(accel: float, feed: float, jerk: float, tasks: Tasks) -> None:
    """10 mm/s² is Grbl's default: 8 s to a stop. Nothing is late here, so nothing slows the job down."""
    host = Host(axes=3, tasks=tasks)
    host.settings(s100=250, s110=6000, s120=accel, s121=accel, s122=accel, s40=jerk)
    way_mm = 2.2 * (feed / 60) ** 2 / accel + (150 if jerk else 0)
    host.start(f"G1X{way_mm:.1f}F{feed}\n")
    host.until(host.ticks() + 40 * host.timer_hz)
    run = host.settle()
    host.close()
    assert run.counters.underruns == 0 and "[MSG:" not in run.said
    assert run.counted() == run.position == [round(way_mm, 1) * 250, 0, 0, 0, 0, 0]
    t = run.seconds()
    top = 250 / (t[250:] - t[:-250]).min() / 250
    assert jerk or top == pytest.approx(feed / 60, rel=0.02)


@pytest.mark.parametrize(("accel", "jerk"), [(20, 500_000), (50, 50_000), (50, 500_000), (500, 30_000)])
def test_a_stop_with_limited_jerk_keeps_the_acceleration(accel: float, jerk: float) -> None:
    for line in ("G1X40F900\n", "G2X20Y0I10J0F900\n"):
        host = Host(axes=3)
        host.settings(s100=1000, s101=1000, s110=6000, s111=6000, s120=accel, s121=accel, s40=jerk)
        host.stall_sides(BOTH, host.ticks() / host.timer_hz + 1.5, 3.0)
        run = host.run(line)
        host.close()
        t, at = run.seconds(), run.positions()[:, :2] / 1000
        grid = np.arange(t[0] - 0.03, t[-1] + 0.03, 0.001)
        place = np.stack([np.interp(grid, t, at[:, ax]) for ax in range(2)], 1)
        second = (place[20:] - 2 * place[10:-10] + place[:-20]) / WINDOW_S**2
        assert np.abs(second).max() <= 1.2 * accel + 2 / 1000 / WINDOW_S**2


def test_a_stop_for_lack_of_data_is_counted_and_said_once() -> None:
    run = run_with(PROGRAMS["line"], [(BOTH, 1.0, 0.5)])
    assert run.counters.underruns == 1
    assert run.said.count("[MSG:Motion slowed down because the controller was busy") == 1
    assert undisturbed(PROGRAMS["line"]).said.count("[MSG:") == 0


def test_the_end_of_a_job_is_no_underrun() -> None:
    """A long last line of which all is known, and the task late while it ends."""
    plain = undisturbed("G1X30F3000\n")
    end_s = float(plain.seconds()[-1] - plain.seconds()[0])
    run = run_with("G1X30F3000\n", [(BOTH, end_s - 0.02, 0.3)])
    assert_legal(run)
    assert run.counters.underruns == 0 and "[MSG:" not in run.said


@pytest.mark.parametrize("command", ["!", "\x18", "\x91\x91", "\x9a", "!~"])
@pytest.mark.parametrize("name", ["line", "arc", "polygon"])
def test_commands_between_stalls(name: str, command: str) -> None:
    for seed in range(4):
        rng = random.Random(f"{name}{command}{seed}")
        host = fresh()
        begin_s = host.ticks() / host.timer_hz
        for stall in random_stalls(rng, BOTH, 0.2):
            host.stall_sides(stall[0], begin_s + stall[1], stall[2])
        host.start(PROGRAMS[name])
        host.until(host.ticks() + round(rng.uniform(0.02, 1.5) * host.timer_hz))
        host.put(command)
        run = host.settle()
        if command == "!":
            assert_legal(run)
            host.put("~")
            run = host.settle()
        assert run.counted() == run.position
        if command != "\x18":
            assert_legal(run)
            assert run.position == undisturbed(PROGRAMS[name]).position
        host.close()


def test_a_jog_is_cancelled_between_stalls() -> None:
    for seed in range(6):
        rng = random.Random(seed)
        host = fresh()
        begin_s = host.ticks() / host.timer_hz
        for stall in random_stalls(rng, BOTH, 0.1):
            host.stall_sides(stall[0], begin_s + stall[1], stall[2])
        host.start("$J=G91X200F5000\n")
        host.until(host.ticks() + round(rng.uniform(0.1, 1.0) * host.timer_hz))
        host.put("\x85")
        run = host.settle()
        assert_legal(run)
        assert "<Idle" in host.status()
        host.close()


@pytest.mark.parametrize("name", ["line", "arc", "polygon"])
def test_a_hold_acts_within_a_few_ms_however_much_is_committed(name: str) -> None:
    """The step edges are those without the hold until 12.5 ms after it, at most."""
    plain = undisturbed(PROGRAMS[name])
    for at_s in (0.35, 0.5, 0.77):
        host = fresh()
        host.start(PROGRAMS[name])
        ticks = host.ticks() + round(at_s * host.timer_hz)
        host.until(ticks)
        host.put("!")
        run = host.settle()
        host.close()
        shift = int(plain.events["t"][0]) - int(run.events["t"][0])
        same = min(len(run.events), len(plain.events))
        apart = (
            np.abs(run.events["t"][:same].astype(np.int64) + shift - plain.events["t"][:same].astype(np.int64)) > 200
        )
        assert apart.any()
        first_s = (int(run.events["t"][int(np.argmax(apart))]) - ticks) / run.timer_hz
        assert 0 <= first_s <= 0.0125
