"""The measures of `make bench-motion` measure what they say: closed forms, and traces with a known fault."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from bench.jobs import write_jobs
from bench.measure import build_driver
from bench.motion import BASELINE, Limits, baseline, measure, with_stalls
from bench.optimum import optimal_time_s
from bench.program import read_program
from bench.steps import Steps, derivative, deviation
from wificnc.profile import load_machine

RATE_MM_S, ACCEL_MM_S2 = 5000 / 60, 500.0


@pytest.fixture
def limits() -> Limits:
    return baseline(load_machine(str(BASELINE)))


def job(folder: Path, text: str) -> Path:
    path = folder / "job.nc"
    path.write_text(text)
    return path


@pytest.mark.parametrize(("length_mm", "feed_mm_min"), [(30, 3000), (2, 5000), (12, 600)])
def test_the_best_time_of_a_line_is_its_trapezoid(tmp_path: Path, length_mm: float, feed_mm_min: float) -> None:
    v, a = feed_mm_min / 60, ACCEL_MM_S2
    exact = 2 * math.sqrt(length_mm / a) if v * v / a > length_mm else length_mm / v + v / a
    program = read_program(job(tmp_path, f"G1 X{length_mm} F{feed_mm_min}\n"))
    assert optimal_time_s(program, 0.01, RATE_MM_S, a) == pytest.approx(exact, rel=0.002)


def test_the_best_time_knows_rests(tmp_path: Path) -> None:
    program = read_program(job(tmp_path, "G1X5F3000\nM3S10\nX10\n"))
    exact = 2 * (5 / 50 + 50 / ACCEL_MM_S2)
    assert optimal_time_s(program, 0.01, RATE_MM_S, ACCEL_MM_S2) == pytest.approx(exact, rel=0.002)


def test_the_best_time_of_a_slow_circle_is_its_feeds(tmp_path: Path) -> None:
    program = read_program(job(tmp_path, "G2 X0 Y0 I5 F1200\n"))
    v = 20.0
    exact = math.tau * 5 / v + v / ACCEL_MM_S2
    assert optimal_time_s(program, 0.01, RATE_MM_S, ACCEL_MM_S2) == pytest.approx(exact, rel=0.003)


@pytest.mark.parametrize(("word", "radius_mm"), [("I10", 10.0), ("R10", 10.0), ("R-10", 10.0)])
@pytest.mark.parametrize("code", ["G2", "G3"])
def test_arcs_keep_their_radius(tmp_path: Path, code: str, word: str, radius_mm: float) -> None:
    program = read_program(job(tmp_path, f"G1F600X0\n{code}X20Y0{word}\n"))
    away = np.linalg.norm(program.points_mm[:, :2] - [10, 0], axis=1)
    assert np.abs(away - radius_mm).max() < 1e-6
    assert np.sign(program.points_mm[len(program.points_mm) // 2, 1]) == (1 if code == "G2" else -1)


def test_a_quarter_by_radius_is_the_near_one_and_the_far_one(tmp_path: Path) -> None:
    near, far = (read_program(job(tmp_path, f"G3X10Y10R{r}F600\n")).points_mm for r in ("10", "-10"))
    assert np.allclose(np.linalg.norm(near[:, :2] - [0, 10], axis=1), 10)
    assert np.allclose(np.linalg.norm(far[:, :2] - [10, 0], axis=1), 10)


def test_words_beyond_the_reader_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"job\.nc:2: 'G81"):
        read_program(job(tmp_path, "G0X1\nG81X1Z-1R1F9\n"))


def test_units_planes_and_increments(tmp_path: Path) -> None:
    text = "G20G91G1X1F10\nG18G2X1Z1I1K0\nG21G90G0X0\n"
    program = read_program(job(tmp_path, text))
    assert np.allclose(program.points_mm[1], [25.4, 0, 0])
    assert np.allclose(program.points_mm[-2], [50.8, 0, 25.4]) and np.allclose(program.points_mm[-1], [0, 0, 25.4])
    assert program.feed_mm_s[0] == pytest.approx(254 / 60)


def trace(program_points: np.ndarray, aside_mm: float) -> Steps:
    """A step each 0.01 mm along these points at 10 mm/s, with a bump half way."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(program_points, axis=0), axis=1))])
    s = np.arange(0, length[-1], 0.01)
    at = np.stack([np.interp(s, length, program_points[:, axis]) for axis in range(3)], axis=1)
    at[len(at) // 2, 2] += aside_mm
    line = np.clip(np.searchsorted(length, s, side="left"), 1, len(length) - 1)
    return Steps(s / 10.0, at, line, 0.0)


def test_a_bump_is_found_with_its_line(tmp_path: Path) -> None:
    program = read_program(job(tmp_path, "G1X5F600\nY5\nX0\nY0\n"))
    found = deviation(trace(program.points_mm, 0.034), program)
    assert found.path_mm == pytest.approx(0.034, abs=1e-6) and found.line in (2, 3)
    assert found.vertex_mm < 0.011


def test_a_corner_cut_short_is_found_at_its_vertex(tmp_path: Path) -> None:
    program = read_program(job(tmp_path, "G1X5F600\nX4.9\nY1\n"))  # a spike of 0.1 mm
    steps = trace(np.array([[0, 0, 0], [4.9, 0, 0], [4.9, 0.0001, 0], [4.9, 1, 0]]), 0.0)
    found = deviation(steps, program)
    assert found.path_mm < 1e-3 and found.vertex_mm == pytest.approx(0.1, abs=0.011)


def test_derivatives_of_a_parabola() -> None:
    t = np.sqrt(2 * np.arange(0, 10, 0.0005) / 300.0)
    at = np.zeros((len(t), 3))
    at[:, 1] = 150.0 * t * t
    accel = derivative(Steps(t, at, np.ones(len(t), np.int64), 0.0), 2, 0.02)
    assert np.median(accel) == pytest.approx(300.0, rel=0.01)


STEP_MM = 1.0 / 250.0


def ramp(accel_mm_s2: tuple[float, float], seconds: float, phase: tuple[float, float]) -> Steps:
    """X and Y from rest, each step exactly when it is due. @param phase  of a step, where each begins"""
    times, axes = [], []
    for axis, (a, begun) in enumerate(zip(accel_mm_s2, phase, strict=True)):
        due = np.sqrt(2.0 * (np.arange(1, 0.5 * a * seconds**2 / STEP_MM + begun) - begun) * STEP_MM / a)
        times.append(due)
        axes.append(np.full(len(due), axis))
    t, axis = np.concatenate(times), np.concatenate(axes)
    order = np.argsort(t, kind="stable")
    at = np.zeros((len(t), 3))
    for number in range(2):
        at[:, number] = STEP_MM * np.cumsum(axis[order] == number)
    return Steps(t[order], at, np.ones(len(t), np.int64), 0.0)


def greatest(steps: Steps, seconds: float) -> float:
    """Between two windows from the ends: the ramp's beginning and end are no part of it."""
    accel = derivative(steps, 2, 0.010)
    return float(accel[40 : int(seconds * 1000) - 10].max())


@pytest.mark.parametrize("slow", [0.3, 0.55, 0.83, 0.97])
def test_steps_of_other_axes_are_no_acceleration(slow: float) -> None:
    """Where an axis is when another one steps is between two of its own steps."""
    rng = np.random.default_rng(1)
    found = [greatest(ramp((500.0, slow * 500.0), 0.1, (p, q)), 0.1) for p, q in rng.random((20, 2))]
    assert max(found) <= 1.01 * 500.0


def test_acceleration_that_is_there_is_found() -> None:
    found = greatest(ramp((500.0, 650.0), 0.1, (0.3, 0.8)), 0.1)
    assert 0.99 * 650.0 <= found <= 1.01 * 650.0


def test_a_job_keeps_its_budgets(tmp_path: Path, limits: Limits, monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole way, without the instructions: they have a test of their own."""
    monkeypatch.setattr("bench.motion.has_valgrind", lambda: False)
    text = "G1F4000\n" + "".join(f"X{0.2 * n:.2f}Y{math.sin(0.4 * n):.4f}Z{math.cos(0.3 * n):.4f}\n" for n in range(60))
    report = measure(build_driver(), job(tmp_path, text), limits)
    assert [figure.name for figure in report.figures if not figure.is_met] == []


def test_stops_for_late_tasks_keep_the_path(tmp_path: Path, limits: Limits) -> None:
    """Short curves everywhere: a stop of a few long segments would cut across them."""
    file = next(path for path in write_jobs(tmp_path) if path.stem == "relief")
    figures = with_stalls(build_driver(), file, read_program(file), limits)
    assert [figure.name for figure in figures if not figure.is_met] == []
