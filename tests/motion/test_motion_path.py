"""The path inside its tolerance, seen with steps of 0.2 um: the grain of usual steps would hide a third of it."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from motion_host import BASELINE, Host, Run
from numpy.typing import NDArray
from test_motion_jerk import farthest_mm, zigzag

FINE_PER_MM, ACCEL_MM_S2, DEVIATION_MM = 5000.0, 500.0, 0.01
# A sample each 2 ms: a chord of a curve lies a T^2/8 off it; all three axes, at their limit.
SAMPLING_MM = math.sqrt(3) * ACCEL_MM_S2 * 0.002**2 / 8
STEP_MM = (0.5 * math.sqrt(3) + 0.5) / FINE_PER_MM


def noisy_curve(seed: int, noise_mm: float) -> str:
    """Chords of 0.03 mm along a spiral, each point off by noise."""
    rng = random.Random(seed)
    lines = ["G90G1F5000"]
    for n in range(1, 200):
        angle, radius = 0.02 * n, 1.0 + 0.004 * n
        x, y = radius * math.sin(angle), 1.0 - radius * math.cos(angle)
        at = [value + rng.gauss(0, noise_mm) for value in (x, y, 0.2 * angle)]
        lines.append("".join(f"{a}{v:.5f}" for a, v in zip("XYZ", at, strict=True)))
    return "\n".join(lines) + "\n"


PROGRAMS = {
    "corners": "G90G1F5000\nX3Y0Z0\nX3Y3Z0\nX1Y1Z0\nX1.5Y1.1Z0\nX1.5Y1.1Z2\n",
    "slow corners": "G90G1F900\nX1Y0Z0\nX1Y1Z0\nX0.5Y0.2Z0\n",
    # the first point is left out, as far as may be, on the side from which the corner after it leads away
    "left out at a corner": "G90G1F5000\nX1Y-0.0028Z0\nX0.999Y0Z0\nX0.999Y1Z0\n",
    "left out on both sides": "G90G1F5000\nX0.3Y-0.001Z0\nX0.6Y0.0015Z0\nX0.999Y0Z0\nX0.999Y1Z0\n",
    "zigzag": zigzag(3, 10, 3.0),
    "fine zigzag": zigzag(4, 80, 0.3),
    "tiny zigzag": zigzag(5, 150, 0.03),
    "curve": noisy_curve(1, 0.0),
    "noisy curve": noisy_curve(2, 0.001),
    "very noisy curve": noisy_curve(3, 0.004),
}


def fine_run(program: str, **settings: float) -> Run:
    host = Host(axes=3)
    host.settings(**{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3})
    host.settings(s100=FINE_PER_MM, s101=FINE_PER_MM, s102=FINE_PER_MM, s11=DEVIATION_MM, **settings)
    run = host.run(program)
    host.close()
    return run


def vertices(program: str) -> NDArray[np.float64]:
    """Of straight moves that name X, Y and Z."""
    points = [[0.0] * 3]
    for line in program.splitlines():
        if line.startswith("X"):
            x, rest = line[1:].split("Y")
            points.append([float(x), *map(float, rest.split("Z"))])
    return np.array(points)


def deviations_mm(run: Run, points: NDArray[np.float64]) -> tuple[float, float]:
    """Of the steps from the path, and of its vertices from the steps."""
    places = np.vstack([np.zeros(3), run.positions()[:, :3]]) / FINE_PER_MM
    parts = np.array_split(places[::17], 40)
    missed = (np.sqrt(((places - point) ** 2).sum(axis=1)).min() for point in points)
    return max(farthest_mm(part, points) for part in parts if len(part)), float(max(missed))


@pytest.mark.parametrize("jerk", [0, 20_000, 100_000])
@pytest.mark.parametrize("name", PROGRAMS)
def test_the_path_stays_within_its_tolerance(name: str, jerk: int) -> None:
    run = fine_run(PROGRAMS[name], s40=jerk)
    away_mm, missed_mm = deviations_mm(run, vertices(PROGRAMS[name]))
    assert away_mm <= DEVIATION_MM + SAMPLING_MM + STEP_MM
    assert missed_mm <= DEVIATION_MM + SAMPLING_MM + STEP_MM


def test_the_path_stays_within_its_tolerance_at_high_acceleration() -> None:
    """Where a chord of 2 ms would lie 7 um off its curve, segments are shorter."""
    program = "G90G1F20000\n" + "".join(f"X{n}Y{n % 2}Z0\n" for n in range(1, 30))
    accel = dict.fromkeys(("s120", "s121", "s122"), 8000) | dict.fromkeys(("s110", "s111", "s112"), 20000)
    run = fine_run(program, **accel)
    away_mm, missed_mm = deviations_mm(run, vertices(program))
    assert max(away_mm, missed_mm) <= DEVIATION_MM * (1 + 0.045) + STEP_MM


@pytest.mark.parametrize("jerk", [0, 20_000])
def test_the_tolerance_of_a_corner_is_used(jerk: int) -> None:
    """Not far inside of it either: a slow corner is a wrong one, too."""
    run = fine_run(PROGRAMS["corners"], s40=jerk)
    _, missed_mm = deviations_mm(run, vertices(PROGRAMS["corners"]))
    assert missed_mm >= 0.7 * DEVIATION_MM


def corners(parts: int) -> str:
    """Turns of 60 degrees after sides of 0.6 mm, each of them so many moves in line."""
    at, lines = np.zeros(2), ["G90G1F5000"]
    for n in range(40):
        angle = math.radians(60 * (n % 2))
        side = 0.6 * np.array([math.cos(angle), math.sin(angle)])
        lines += [f"X{x:.5f}Y{y:.5f}Z0" for x, y in (at + side * (k + 1) / parts for k in range(parts))]
        at = at + side
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("parts", [2, 3])
def test_points_in_line_take_nothing_of_the_tolerance(parts: int) -> None:
    """They are left out, and the chord passes through them: corners have all of it, and take as long as without."""
    whole, cut = (fine_run(corners(n)).seconds() for n in (1, parts))
    assert cut[-1] - cut[0] == pytest.approx(whole[-1] - whole[0], rel=1e-3)


@pytest.mark.parametrize("code", ["G2", "G3"])
@pytest.mark.parametrize("arc_mm", [0.001, 0.002, 0.005])
def test_chords_of_an_arc_and_their_rounding_share_the_tolerance(code: str, arc_mm: float) -> None:
    run = fine_run(f"G90{code}X0Y0I2J0F3000\n", s12=arc_mm)
    places = run.positions()[:, :2] / FINE_PER_MM
    away = np.abs(np.hypot(places[:, 0] - 2, places[:, 1]) - 2)
    assert away.max() <= max(DEVIATION_MM, arc_mm) + SAMPLING_MM + STEP_MM


@pytest.mark.parametrize("jerk", [0, 5_000, 100_000])
def test_exact_stops_have_no_tolerance(jerk: int) -> None:
    """Limited jerk must not take the corner off either."""
    run = fine_run("G90G61G1F5000\nX2Y0Z0\nX2Y2Z0\nX1.5Y0.5Z1\n", s40=jerk)
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1.5, 0.5, 1]])
    assert farthest_mm(run.positions()[::7, :3] / FINE_PER_MM, points) <= STEP_MM
    places = {tuple(place) for place in run.positions()[:, :3].tolist()}
    assert {tuple(round(value * FINE_PER_MM) for value in point) for point in points[1:].tolist()} <= places
