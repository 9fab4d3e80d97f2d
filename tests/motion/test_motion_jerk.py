"""`$40`: how fast the acceleration of any axis changes, seen on the step trace."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import lawful
import numpy as np
import pytest
from lawful import Machine
from motion_host import AXES, BASELINE, Host, Run
from numpy.typing import NDArray

STEPS_PER_MM, ACCEL_MM_S2, DEVIATION_MM = 250.0, 500.0, 0.01


def derivatives(run: Run, window_s: float, steps_per_mm: float = STEPS_PER_MM) -> list[NDArray[np.float64]]:
    """Speed, acceleration and jerk of every axis, by box differences of the interpolated positions."""
    t = np.concatenate([[run.seconds()[0] - 1e-3], run.seconds()])
    path = np.vstack([np.zeros(AXES), run.positions()]) / steps_per_mm
    grid = np.arange(t[0] - 4 * window_s, t[-1] + 4 * window_s, window_s / 10)
    found = [np.stack([np.interp(grid, t, path[:, ax]) for ax in range(AXES)], axis=1)]
    for _ in range(3):
        found.append((found[-1][10:] - found[-1][:-10]) / window_s)
    return found[1:]


def zigzag(seed: int, count: int, length_mm: float) -> str:
    rng = random.Random(seed)
    at, lines = [0.0] * 3, ["G90G1F5000"]
    for _ in range(count):
        at = [min(60.0, max(-60.0, value + rng.uniform(-length_mm, length_mm))) for value in at]
        lines.append("".join(f"{a}{v:.3f}" for a, v in zip("XYZ", at, strict=True)))
    return "\n".join(lines) + "\n"


def chopped_circle(chord_mm: float, radius_mm: float = 20) -> str:
    r, count = radius_mm, round(2 * math.pi * radius_mm / chord_mm)
    angles = [2 * math.pi * n / count for n in range(1, count + 1)]
    return "G90G1F5000\n" + "".join(f"X{r * math.sin(a):.4f}Y{r - r * math.cos(a):.4f}\n" for a in angles)


def mean(jerk: float) -> tuple[float, float]:
    """What limited jerk makes of $11 (docs/motion.md, 9): the part k of the acceleration that is used, and the time T
    of the mean. T = 2 k A / J with k^3 = 6 e J^2 / 1.15 A^3, e half of $11."""
    part = min(1.0, (6 * 0.5 * DEVIATION_MM * jerk**2 / (1.15 * ACCEL_MM_S2**3)) ** (1 / 3))
    return part, max(2 * part * ACCEL_MM_S2 / jerk, 0.002)


@pytest.mark.parametrize("jerk", [5_000, 20_000, 100_000])
@pytest.mark.parametrize("program", [zigzag(1, 60, 25.0), zigzag(2, 150, 1.0), chopped_circle(0.1), "G0X40\n"])
def test_no_axis_exceeds_its_jerk(host: Host, jerk: int, program: str) -> None:
    host.settings(s40=jerk)
    window_s = 0.02
    grain = 1 / (STEPS_PER_MM * window_s**2)  # one step
    _, accel, third = derivatives(host.run(program), window_s)
    assert np.abs(third).max() <= jerk + 4 * grain / window_s
    assert np.abs(accel).max() <= ACCEL_MM_S2 + 2 * grain


# From stop to stop, and back again: hardly any of these lines reaches its feed.
SHORT = "G90G61G1F5000\n" + "".join(f"X{mm}\nX0\n" for mm in (0.01, 0.05, 0.1, 0.2, 0.4, 0.8)) + "G64\nX1Y0.1\nX0\nX1\n"


@pytest.mark.parametrize("jerk", [5_000, 20_000, 100_000])
@pytest.mark.parametrize("program", [zigzag(1, 8, 5.0), zigzag(2, 60, 0.5), chopped_circle(0.2, 4), "G0X8\n", SHORT])
def test_no_axis_exceeds_its_jerk_while_the_acceleration_changes(jerk: int, program: str) -> None:
    """The acceleration changes within T, a few ms: steps of 1/5000 mm can be differentiated over half of it. A window
    longer than T would see less jerk than there is."""
    fine = 5000.0
    host = Host(axes=3)
    host.settings(**{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3})
    host.settings(s100=fine, s101=fine, s102=fine, s11=DEVIATION_MM, s40=jerk)
    window_s = mean(jerk)[1] / 2
    _, accel, third = derivatives(host.run(program), window_s, fine)
    host.close()
    grain = 1 / (fine * window_s**2)
    assert np.abs(third).max() <= jerk + 4 * grain / window_s
    # Within one segment all axes share one ramp: docs/motion.md, 11.
    assert np.abs(accel).max() <= 1.05 * ACCEL_MM_S2 + 2 * grain


def test_without_it_a_line_begins_with_its_whole_acceleration(host: Host) -> None:
    """The measure sees a trapezoid: 500 mm/s2 immediately, over a window of 20 ms."""
    _, _, third = derivatives(host.run("G0X40\n"), 0.02)
    assert np.abs(third).max() > 0.75 * ACCEL_MM_S2 / 0.02


def shortest_s(length_mm: float, accel: float, jerk: float, speed_mm_s: float) -> float:
    """From rest to rest along an axis within these limits: the greatest jerk at all times, or none."""

    def rise_s(v: float) -> float:
        return 2 * math.sqrt(v / jerk) if v < accel**2 / jerk else v / accel + accel / jerk

    low, high = 0.0, speed_mm_s
    for _ in range(60):
        v = (low + high) / 2
        low, high = (v, high) if v * rise_s(v) <= length_mm else (low, v)
    return 2 * rise_s(low) + (length_mm - low * rise_s(low)) / low


@pytest.mark.parametrize("length_mm", [0.3, 1.0, 3.0, 20.0, 80.0])
@pytest.mark.parametrize("jerk", [5_000, 20_000, 100_000, 1_000_000])
def test_a_line_takes_hardly_longer_than_it_must(host: Host, jerk: int, length_mm: float) -> None:
    """Steps of the acceleration up to 3kA, averaged, are a ramp of the greatest jerk."""
    host.settings(s40=jerk)
    run = host.run(f"G1X{length_mm}F5000\n")
    took_s = run.seconds()[-1] - run.seconds()[0]
    best_s = shortest_s(length_mm, min(1.0, 3 * mean(jerk)[0]) * ACCEL_MM_S2, jerk, 5000 / 60)
    assert best_s - 0.02 < took_s < 1.01 * best_s + 0.005  # its first step is late, its last early


FEEDS = "G90G1F5000X10\nF1200X13\nF3000X16\nF60X16.2\nF5000X30Y2\nY2.02\nX29.98\nX10Y3F5000\nX9.5\nX9F4000\nX0Y0\n"


@pytest.mark.parametrize("jerk", [5_000, 20_000, 100_000])
@pytest.mark.parametrize("seed", range(3))
def test_holds_and_overrides_keep_the_jerk(jerk: int, seed: int) -> None:
    """The program has other feeds along a line, corners close to each other, and long ways."""
    fine, rng = 5000.0, random.Random(seed)
    host = Host(axes=3)
    host.settings(**{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3})
    host.settings(s100=fine, s101=fine, s102=fine, s11=DEVIATION_MM, s40=jerk)
    host.start(FEEDS)
    for _ in range(16 if seed else 0):
        host.until(host.ticks() + round(rng.uniform(0.005, 0.3) * host.timer_hz))
        host.put(rng.choice(["!", "~", "\x90", "\x91", "\x92", "\x96", "\x97", "~"]))
    host.put("~\x90")
    host.settle()
    host.put("~")
    run = host.settle()
    host.close()
    window_s = mean(jerk)[1] / 2
    grain = 1 / (fine * window_s**2)
    _, accel, third = derivatives(run, window_s, fine)
    assert run.counted()[:2] == [0, 0] and run.counters.plan_unmet == 0
    assert np.abs(third).max() <= jerk + 4 * grain / window_s
    assert np.abs(accel).max() <= ACCEL_MM_S2 + 2 * grain


@pytest.mark.parametrize("jerk", [2_000, 30_000, 1_000_000])
@pytest.mark.parametrize("seed", range(3))
def test_the_end_is_exact_and_the_path_in_the_tolerance(host: Host, jerk: int, seed: int) -> None:
    host.settings(s40=jerk)
    program = zigzag(seed, 40, 4.0)
    run = host.run(program)
    points = [(0.0, 0.0, 0.0)]
    points += [tuple(float(word[1:]) for word in split(line)) for line in program.splitlines()[1:]]
    assert run.counted()[:3] == [nearest(value * STEPS_PER_MM) for value in points[-1]]
    assert farthest_mm(run.positions()[::7, :3] / STEPS_PER_MM, np.array(points)) <= DEVIATION_MM + 1.5 / STEPS_PER_MM


def needles(angle_deg: float, way: tuple[float, float, float], length_mm: float) -> NDArray[np.float64]:
    """Corners that turn by this angle, left and right in turn, of lines that lie evenly on both sides of this way."""
    along = np.array(way) / np.linalg.norm(way)
    aside = np.cross(along, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(along, [0.0, 0.0, 1.0]))
    half = math.radians(angle_deg) / 2
    lines = [length_mm * (math.cos(half) * along + (-1) ** n * math.sin(half) * aside) for n in range(6)]
    return np.vstack([np.zeros(3), np.cumsum(lines, axis=0)])


@pytest.mark.parametrize("jerk", [5_000, 20_000, 100_000])
@pytest.mark.parametrize("way", [(1, 1, 0), (1, 0, 0), (1, 1, 1)])
def test_a_corner_is_cut_no_deeper_than_the_tolerance(jerk: int, way: tuple[float, float, float]) -> None:
    """Both ways: no step is farther from the program, and none of its points is farther from the steps."""
    fine = 2000.0
    host = Host(axes=3)
    host.settings(**{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3})
    host.settings(s100=fine, s101=fine, s102=fine, s11=DEVIATION_MM, s40=jerk)
    at, most_mm = np.zeros(3), DEVIATION_MM + 1.5 / fine + 1e-4
    for angle_deg in (10, 30, 60, 90, 120, 150, 170):
        points = needles(angle_deg, way, 1.5) + at
        run = host.run("G90G1F5000\n" + "".join("X{:.4f}Y{:.4f}Z{:.4f}\n".format(*p) for p in points[1:]))
        steps = at + run.positions()[:, :3] / fine
        at = np.array(run.position[:3]) / fine
        assert farthest_mm(steps[::11], points) <= most_mm, f"{angle_deg} degrees"
        missed_mm = max(float(np.linalg.norm(steps - p, axis=1).min()) for p in points[1:])
        assert missed_mm <= most_mm, f"{angle_deg} degrees"
    host.close()


def nearest(steps: float) -> int:
    """Halves away from zero; a millionth of a step is the decimal's rounding."""
    return round(math.copysign(math.floor(abs(steps) + 0.5 + 1e-6), steps))


def split(line: str) -> list[str]:
    y, z = line.index("Y"), line.index("Z")
    return [line[:y], line[y:z], line[z:]]


def farthest_mm(places: NDArray[np.float64], points: NDArray[np.float64]) -> float:
    """Greatest distance of any place from the polyline."""
    begin, chord = points[:-1], np.diff(points, axis=0)
    along = np.einsum("pij,ij->pi", places[:, None] - begin, chord) / np.maximum((chord**2).sum(axis=1), 1e-12)
    nearest = begin + np.clip(along, 0, 1)[:, :, None] * chord
    return float(np.sqrt(((places[:, None] - nearest) ** 2).sum(axis=2)).min(axis=1).max())


@pytest.mark.parametrize("deviation", [0.0, 0.01])
@pytest.mark.parametrize("jerk", [0.001, 0.005, 0.2, 20, 250])
def test_the_least_jerk_takes_long_and_ends(host: Host, jerk: float, deviation: float) -> None:
    """2 A / J would be up to days, and no window is longer than a second: the acceleration is what suffices."""
    host.settings(s40=jerk, s11=deviation)
    run = host.run("G90G1F5000X0.5Y0.1\nX0.2\n")
    assert run.positions()[-1][:3].tolist() == [50, 25, 0]
    if jerk >= 20:
        window_s = 0.1
        grain = 1 / (STEPS_PER_MM * window_s**2)
        assert np.abs(derivatives(run, window_s)[2]).max() <= jerk + 4 * grain / window_s


@pytest.mark.alike(2)
@pytest.mark.parametrize(
    ("steps_per_mm", "accel_mm_s2", "jerk", "shaper"),
    [(2000.0, 50.0, 100.0, ()), (4000.0, 500.0, 1000.0, ()), (1500.0, 50.0, 100.0, (4, 5.0, 0.1))],
    ids=["300,000 steps/s", "600,000 steps/s", "225,000 steps/s, shaped"],
)
def test_a_long_mean_of_fast_steps_is_none_too_long(
    steps_per_mm: float, accel_mm_s2: float, jerk: float, shaper: tuple[float, ...]
) -> None:
    """2 A / J is a second: that of so many steps, times ns, would not fit 64 bits. The monitor watches the limits."""
    machine = Machine((steps_per_mm,) * 3, (9_000.0,) * 3, (accel_mm_s2,) * 3, jerk_mm_s3=jerk, deviation_mm=0.0)
    machine = replace(machine, shapers=(shaper,) * 3 if shaper else ())
    fast = machine.host()
    run = fast.run("G0X1500\nX0\n")
    fast.close()
    assert run.position[0] == 0
    speed, _ = lawful.derivatives(run.seconds(), run.positions(), machine, 0.01)
    assert 140 < speed.max() < 150.5


def test_an_exact_stop_is_reached_exactly(host: Host) -> None:
    host.settings(s40=10_000)
    run = host.run("G61G1F3000X10\nY10\nX0\n")
    path = run.positions()[:, :2]
    for corner in ((2500, 0), (2500, 2500)):
        assert (path == corner).all(axis=1).any()
    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    assert farthest_mm(np.c_[path / STEPS_PER_MM, np.zeros(len(path))], corners) < 1e-9


def test_chords_of_a_tenth_of_a_mm_are_as_fast_as_the_arc(host: Host) -> None:
    """Issue: a file of 0.1 mm segments must not be slower than the same curve as one arc by more than 2 %."""
    host.settings(s40=100_000)
    arc_s = duration_s(host, "G90G3F5000X0Y0I0J20\n")
    chords_s = duration_s(host, chopped_circle(0.1))
    assert chords_s <= 1.02 * arc_s


def duration_s(host: Host, program: str) -> float:
    run = host.run(program)
    return float(run.seconds()[-1] - run.seconds()[0])


@pytest.mark.parametrize("stop", ["!", "\x18"])
def test_a_stop_anywhere_keeps_the_position(stop: str) -> None:
    for events in range(500, 9000, 1300):
        host = Host()
        host.settings(**BASELINE, s11=DEVIATION_MM, s40=20_000)
        host.start(zigzag(5, 20, 8.0))
        host.advance(events)
        host.put(stop)
        held = host.settle()
        assert held.counted() == held.position
        if stop == "!":
            host.put("~")
            ended = host.settle()
            assert ended.counted() == ended.position
        host.close()
