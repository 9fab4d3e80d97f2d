"""Interruptions at every segment of small programs: hold, reset, e-stop, overrides, jog cancel, probe, late input.

A failing case names itself: program, segment, event. `WIFICNC_MATRIX_STRIDE=1` runs all segments; otherwise every
event visits every STRIDE-th segment, and events start at different ones, so that together they visit them all.
"""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from motion_host import BASELINE, Host, Run
from numpy.typing import NDArray
from test_motion_jerk import farthest_mm, mean
from test_motion_limits import ACCEL_MM_S2, STEPS_PER_MM, windowed

STRIDE = int(os.environ.get("WIFICNC_MATRIX_STRIDE", "8"))
WAVE = "".join(f"X{0.2 * n:.3f}Y{1.2 * math.sin(0.5 * n * 0.2):.4f}\n" for n in range(1, 41))
PROGRAMS = {
    "line": "G1X9Y4F5000\n",
    "corner": "G1F4000X5\nY4\nX8Y1Z1\n",
    "arc": "G2X0Y8I0J4F4000\n",
    "dense": "G1F5000\n" + WAVE,
    "stops": "G61G1F3000X2\nY2\nX0\n",
    "rapid": "G0X6Y3\nX9Y-2\n",
    "jog": "$J=G91X6Y3F4000\n",
    "probe": "G38.3Z-6F2500\n",
}
RADIUS_MM = {"arc": 4.0, "dense": 1 / (1.2 * 0.5**2)}  # where they bend most
BLEND_MM = {"corner": 0.2, "rapid": 0.2}  # the blends of their corners, inside a tube of 0.01 mm, are shorter
JERK_MM_S3 = {"line": 0, "corner": 0, "arc": 60_000, "dense": 0, "stops": 60_000, "rapid": 0, "jog": 0, "probe": 0}
RUNNING = [name for name in PROGRAMS if name != "jog"]

# From the byte to the first step that is decided after it: what emission and prep have decided ahead, and a slice.
REACTION_S = 0.003 * 1.5 + 0.003 + 0.002 + 0.003
STEP_MM = 1 / STEPS_PER_MM


@dataclass(frozen=True)
class Plain:
    """A program that no one interrupts."""

    run: Run
    segments: list[int]  # tick at which each begins
    near: NDArray[np.int64]  # packed positions of its path and around it: see steps_off()


def fresh(name: str) -> Host:
    host = Host(axes=3)
    baseline = {key: value for key, value in BASELINE.items() if int(key[1:]) % 10 < 3}
    host.settings(**baseline, s11=0.01, s12=0.002, s40=JERK_MM_S3[name])
    return host


def packed(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """X, Y, Z in one number."""
    return ((places[:, 0] + 2**20) << 42) + ((places[:, 1] + 2**20) << 21) + places[:, 2] + 2**20


def steps_off(name: str) -> int:
    """A step by rounding. With limited jerk bends are cut less at a lower speed, which is half of $11 at most."""
    return 1 if JERK_MM_S3[name] == 0 else 1 + round(0.5 * 0.01 * STEPS_PER_MM)


@functools.cache
def plain(name: str) -> Plain:
    host = fresh(name)
    host.start(PROGRAMS[name])
    segments, count = [], host.counters().segments
    while host.advance(1) != 0:
        if host.counters().segments != count:
            count = host.counters().segments
            segments.append(host.ticks())
    run = host.settle()
    host.close()
    steps = np.arange(-steps_off(name), steps_off(name) + 1)
    around = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    path = run.positions()[:, :3]
    return Plain(run, segments, np.unique(np.concatenate([packed(path + by) for by in around])))


def moments(name: str, event: int) -> list[tuple[int, int]]:
    """Segments that this event visits: index and a tick in the middle of it."""
    begins = plain(name).segments
    ends = [*begins[1:], int(plain(name).run.events["t"][-1])]
    chosen = range(event * 5 % STRIDE, len(begins), STRIDE)
    return [(k, (begins[k] + ends[k]) // 2) for k in chosen]


def each_moment(name: str, event: int, check: Callable[[Host, int], None]) -> None:
    """Runs the program again for each of them, up to there."""
    for k, ticks in moments(name, event):
        host = fresh(name)
        host.start(PROGRAMS[name])
        host.until(ticks)
        try:
            check(host, ticks)
        except AssertionError as wrong:
            raise AssertionError(f"{name}, segment {k} of {len(plain(name).segments)}: {wrong}") from wrong
        finally:
            host.close()


def speed_at(name: str, ticks: int) -> float:
    """Greatest speed along the path around this moment and until a stop can begin, mm/s."""
    run = plain(name).run
    speed, _ = windowed(run)
    t = run.seconds()[0] - 0.001 - 0.030 + 0.005 + 0.001 * np.arange(len(speed))
    at = ticks / run.timer_hz
    near = np.linalg.norm(speed, axis=1)[(t > at - 0.006) & (t < at + REACTION_S + 0.006)]
    return float(near.max()) if len(near) else 0.0


def way_after(run: Run, ticks: int) -> float:
    """Length of the path after this moment, mm; a staircase counts as its diagonal."""
    t = run.seconds()
    grid = np.append(np.arange(ticks / run.timer_hz, t[-1], 0.004), t[-1])
    path = run.positions()[:, :3] / STEPS_PER_MM
    at = np.stack([np.interp(grid, t, path[:, axis]) for axis in range(3)], axis=1)
    return float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())


def assert_stop_is_short(name: str, run: Run, ticks: int) -> None:
    """v^2 / 2A and what is decided already; with limited jerk the axes follow the mean of the last T = 2A/J or less."""
    part, mean_s = mean(JERK_MM_S3[name]) if JERK_MM_S3[name] else (1.0, 0.0)
    v = speed_at(name, ticks)
    ramp_mm = stop_mm(v, part * ACCEL_MM_S2, RADIUS_MM.get(name, math.inf)) + BLEND_MM.get(name, 0.0)
    assert way_after(run, ticks) <= v * (REACTION_S + mean_s) + ramp_mm + 3 * STEP_MM


@functools.cache
def stop_mm(v_mm_s: float, accel_mm_s2: float, radius_mm: float) -> float:
    """Longest way to a stop from this speed on a circle (inf: a line along an axis): as hard as both axes allow, begun
    at any angle at which they allow this speed at all."""
    if math.isinf(radius_mm):
        return v_mm_s**2 / (2 * accel_mm_s2)
    ds = 0.01
    angle = np.linspace(0, math.pi / 2, 46)
    x, way = np.full_like(angle, v_mm_s**2), np.zeros_like(angle)
    possible = np.ones_like(angle, bool)
    while (x > 0).any():
        along = np.maximum(np.abs([np.cos(angle), np.sin(angle)]), 1e-9)
        inwards = np.array([-np.sin(angle), np.cos(angle)]) * np.sign([np.cos(angle), np.sin(angle)]) * x / radius_mm
        least = ((-accel_mm_s2 - inwards) / along).max(axis=0)
        possible &= (least <= ((accel_mm_s2 - inwards) / along).min(axis=0)) | (way > 0)
        way += np.where(x > 0, ds, 0.0)
        x = np.maximum(x + 2 * ds * np.minimum(least, 0.0), 0.0) * (way < 100)
        angle += ds / radius_mm
    return float(way[possible].max()) if possible.any() else math.inf


def assert_sane(run: Run) -> None:
    """No pulse lost, no limit exceeded: the budgets of the issue, in a window of 10 ms."""
    assert run.counted() == run.position
    _, accel = windowed(run)
    assert np.abs(accel).max() <= 1.2 * ACCEL_MM_S2


def assert_same_path(name: str, run: Run) -> None:
    assert run.position == plain(name).run.position
    assert np.isin(packed(run.positions()[:, :3]), plain(name).near).all()


def same_events(name: str, run: Run) -> bool:
    return np.array_equal(run.events, plain(name).run.events)


@pytest.mark.alike(3)
@pytest.mark.parametrize("name", RUNNING)
def test_a_hold_stops_short_and_goes_on_along_the_same_path(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put("!")
        stopped = host.settle()
        assert_sane(stopped)
        assert_stop_is_short(name, stopped, ticks)
        assert "Hold:0" in host.status() or stopped.position == plain(name).run.position
        host.put("~")
        whole = host.settle()
        assert_sane(whole)
        assert_same_path(name, whole)
        assert whole.answers == plain(name).run.answers

    each_moment(name, 0, check)


@pytest.mark.alike(3)
@pytest.mark.parametrize("name", RUNNING)
def test_a_hold_that_is_lifted_before_it_stands(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put("!")
        host.until(ticks + host.timer_hz // 50)
        host.put("~")
        whole = host.settle()
        assert_sane(whole)
        assert_same_path(name, whole)

    each_moment(name, 1, check)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_reset_stops_at_once_and_knows_where(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put("\x18")
        run = host.settle()
        assert run.counted() == run.position
        assert len(run.events) == 0 or run.events["t"][-1] <= ticks + host.timer_hz // 10_000
        host.put("$X\nG90G1F5000X1Y1Z1\n")
        ended = host.settle()
        assert ended.position == ended.counted() == [250, 250, 250, 0, 0, 0]

    each_moment(name, 2, check)


@pytest.mark.parametrize("name", PROGRAMS)
def test_after_an_e_stop_no_pulse_leaves(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.press("estop", True)
        run = host.settle()
        assert run.counted() == run.position
        assert len(run.events) == 0 or run.events["t"][-1] <= ticks
        host.press("estop", False)
        host.put("\x18")
        host.settle()
        host.put("$X\nG90G1F5000X1Y1Z1\n")
        ended = host.settle()
        assert ended.position == ended.counted() == [250, 250, 250, 0, 0, 0]

    each_moment(name, 3, check)


@pytest.mark.alike(4)
@pytest.mark.parametrize("name", ["line", "corner", "arc", "dense", "stops", "probe"])
@pytest.mark.parametrize("override", ["\x92" * 5, "\x91" * 10, "\x92" * 9 + "\x93" * 9, "\x91" * 9 + "\x92" * 18])
def test_a_feed_override_keeps_path_and_limits(name: str, override: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put(override)
        run = host.settle()
        assert_sane(run)
        assert_same_path(name, run)
        host.put("\x90")
        host.settle()

    each_moment(name, 4 + len(override), check)


@pytest.mark.parametrize("override", ["\x96", "\x97", "\x97\x95"])
def test_a_rapid_override_keeps_path_and_limits(override: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put(override)
        run = host.settle()
        assert_sane(run)
        assert_same_path("rapid", run)
        late = (run.events["t"][-1] - plain("rapid").run.events["t"][-1].astype(np.int64)) / run.timer_hz
        assert late >= -1e-3 and (late < 0.05 or override != "\x97\x95")

    each_moment("rapid", len(override), check)


def test_a_jog_cancel_stops_short() -> None:
    def check(host: Host, ticks: int) -> None:
        host.put("\x85")
        run = host.settle()
        assert_sane(run)
        assert_stop_is_short("jog", run, ticks)
        assert np.isin(packed(run.positions()[:, :3]), plain("jog").near).all()
        assert "<Idle" in host.status()
        host.put("$J=G90X1Y2Z-1F5000\n")
        ended = host.settle()
        assert ended.position == ended.counted() == [250, 500, -250, 0, 0, 0]
        assert_sane(ended)

    each_moment("jog", 1, check)


@pytest.mark.parametrize("name", ["corner", "rapid", "probe"])
def test_a_jog_cancel_is_nothing_to_a_program(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.put("\x85")
        assert same_events(name, host.settle())

    each_moment(name, 2, check)


def test_a_probe_stops_short_and_says_where_it_touched() -> None:
    def check(host: Host, ticks: int) -> None:
        before = int(np.searchsorted(plain("probe").run.events["t"], ticks, side="right"))
        host.press("probe", True)
        run = host.settle()
        assert_sane(run)
        assert_stop_is_short("probe", run, ticks)
        assert np.isin(packed(run.positions()[:, :3]), plain("probe").near).all()
        touched = run.said.split("[PRB:")[1].split("]")[0]
        assert touched == f"0.000,0.000,{-before / STEPS_PER_MM:.3f}:1"

    each_moment("probe", 3, check)


@pytest.mark.parametrize("name", ["corner", "jog"])
def test_a_probe_is_nothing_to_other_motion(name: str) -> None:
    def check(host: Host, ticks: int) -> None:
        host.press("probe", True)
        assert same_events(name, host.settle())

    each_moment(name, 4, check)


@pytest.mark.parametrize("name", ["corner", "dense", "stops", "rapid"])
@pytest.mark.parametrize("pause_s", [0.004, 0.03, 3.0])
def test_late_input_is_a_pause_and_loses_nothing(name: str, pause_s: float) -> None:
    """Lines up to any one of them, silence, and the rest: inside the tolerance, ends exactly, nothing is lost."""
    lines = PROGRAMS[name].splitlines(keepends=True)
    for split in range(1, len(lines), 1 + len(lines) // 12):
        host = fresh(name)
        host.start("".join(lines[:split]))
        host.wait(pause_s)
        host.put("".join(lines[split:]))
        run = host.settle()
        assert run.answers == ["ok"] * len(lines), split
        assert_sane(run)
        assert run.position == plain(name).run.position, split
        places = run.positions()[::5, :3] / STEPS_PER_MM
        assert farthest_mm(places, programmed(lines)) <= 0.01 + 1.5 * STEP_MM, split
        host.close()


def programmed(lines: list[str]) -> NDArray[np.float64]:
    """Vertices of these straight moves."""
    at, points = [0.0] * 3, [[0.0] * 3]
    for line in lines:
        for letter, value in words(line):
            at["XYZ".index(letter)] = value
        points.append(list(at))
    return np.array(points)


def words(line: str) -> list[tuple[str, float]]:
    text = "".join(f" {c}" if c.isalpha() else c for c in line.strip())
    return [(word[0], float(word[1:])) for word in text.split() if word[0] in "XYZ"]
