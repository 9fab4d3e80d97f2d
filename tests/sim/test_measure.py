"""Measuring against closed forms, and against the same method written down a second time in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from sim_native import AXES, RAPID, axis_events, events, measure

HZ = 20_000_000
WINDOW_S = 0.010


def oracle(trace: np.ndarray, hz: int, window_ms: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """Largest |v| and |a| per axis in steps: linear interpolation on a 1 ms grid, box differences over 10 ms for the
    speed, over window_ms for the acceleration."""
    t = (trace["t"] - trace["t"][0]).astype(float) / hz
    bits = np.arange(6)
    moved = (trace["step"][:, None] >> bits & 1) * np.where(trace["dir"][:, None] >> bits & 1, -1, 1)
    position = np.cumsum(moved, axis=0)
    grid = np.arange(-2 * window_ms, int(t[-1] * 1000) + 2 * window_ms + 2) * 1e-3
    q = np.stack([np.interp(grid, t, position[:, axis]) for axis in range(6)], axis=1)
    v = (q[10:] - q[:-10]) / WINDOW_S
    w, window_s = window_ms, window_ms * 1e-3
    a = (q[2 * w :] - 2 * q[w:-w] + q[: -2 * w]) / window_s**2
    return np.abs(v).max(axis=0), np.abs(a).max(axis=0)


def trapezoid_ticks(steps: int, v_steps_s: float, a_steps_s2: float) -> np.ndarray:
    """Edge times of a move from rest to rest: t(s) of a constant acceleration, cruise, the mirror image."""
    s = np.arange(1, steps + 1, dtype=float)
    s_ramp = v_steps_s**2 / (2 * a_steps_s2)
    t_ramp = v_steps_s / a_steps_s2
    t_all = 2 * t_ramp + (steps - 2 * s_ramp) / v_steps_s
    up = np.sqrt(2 * np.minimum(s, s_ramp) / a_steps_s2)
    cruise = t_ramp + (s - s_ramp) / v_steps_s
    down = t_all - np.sqrt(2 * np.clip(steps - s, 0, s_ramp) / a_steps_s2)
    t = np.where(s <= s_ramp, up, np.where(s <= steps - s_ramp, cruise, down))
    return np.round(t * HZ).astype(np.uint64)


def check_oracle(library, trace: np.ndarray, hz: int) -> None:
    measured, _ = measure(library, trace, hz, chunk=777)
    v, a = oracle(trace, hz)
    assert list(measured.max_speed_steps_s) == pytest.approx(v, rel=1e-6, abs=1e-3)
    assert list(measured.max_accel_steps_s2) == pytest.approx(a, rel=1e-6, abs=1e-1)


def test_constant_speed(library):
    ticks = np.arange(1, 20_001, dtype=np.uint64) * 2000  # 10 kHz for 2 s
    measured, _ = measure(library, axis_events(ticks, axis=1, negative=True), HZ)
    assert measured.max_speed_steps_s[1] == pytest.approx(10_000, abs=1e-6)
    assert measured.min_interval_ticks[1] == 2000
    assert measured.steps_total[1] == 20_000
    assert (measured.position_steps[1], measured.min_steps[1], measured.max_steps[1]) == (-20_000, -20_000, 0)
    assert measured.max_accel_steps_s2[1] == pytest.approx(10_000 / WINDOW_S, rel=1e-6)  # starts with a jerk
    assert all(measured.max_speed_steps_s[axis] == 0.0 for axis in AXES if axis != 1)


def test_trapezoid_has_its_speed_and_acceleration(library):
    spm, v, a = 250.0, 80.0, 500.0
    trace = axis_events(trapezoid_ticks(20_000, v * spm, a * spm))
    measured, _ = measure(library, trace, HZ)
    assert measured.max_speed_steps_s[0] / spm == pytest.approx(v, rel=1e-4)
    resolution = 2 / (spm * WINDOW_S**2)
    assert a * 0.999 <= measured.max_accel_steps_s2[0] / spm <= a + resolution
    check_oracle(library, trace, HZ)


@pytest.mark.parametrize(
    ("spm", "limit", "window_ms"), [(80, 400, 25), (250, 500, 13), (800, 500, 10), (10, 50, 100), (80, 2000, 12)]
)
def test_the_window_of_acceleration_spans_ten_steps_from_rest(library, spm, limit, window_ms):
    """W = sqrt(20 / (n A)), in whole ms, 10 to 100: the grain of two steps is at most a tenth of the limit."""
    assert window_ms in (100, max(10, int(np.ceil(1000 * np.sqrt(20 / (spm * limit))))))
    trace = axis_events(trapezoid_ticks(40 * spm, 40.0 * spm, limit * spm))
    measured, _ = measure(library, trace, HZ, expected_steps_s2=limit * spm, chunk=100)
    assert list(measured.accel_window_s) == pytest.approx([window_ms / 1000] * 6)
    grain = 2 / (spm * (window_ms / 1000) ** 2)
    assert window_ms == 100 or grain <= limit / 10
    assert 0.97 * limit <= measured.max_accel_steps_s2[0] / spm <= limit + grain
    assert list(measured.max_accel_steps_s2) == pytest.approx(oracle(trace, HZ, window_ms)[1], rel=1e-6, abs=1e-1)


@pytest.mark.parametrize("hz", [1_000_000, 20_000_000, 12_345_678 // 1000 * 1000, 100_000_000])
def test_random_motion_agrees_with_numpy(library, hz):
    rng = np.random.default_rng(hz)
    gaps_s = rng.choice([2e-5, 1e-4, 1e-3, 9.5e-3, 0.2], p=[0.4, 0.4, 0.15, 0.04, 0.01], size=3000)
    rows = np.zeros(3000, dtype=axis_events(np.zeros(1)).dtype)
    rows["t"] = 12345 + np.cumsum(np.maximum(gaps_s * rng.uniform(0.5, 1.5, 3000) * hz, 1).astype(np.uint64))
    rows["step"] = rng.integers(1, 64, 3000)
    rows["dir"] = rng.integers(0, 64, 3000)
    check_oracle(library, rows, hz)


def test_edges_on_grid_points(library):
    check_oracle(library, axis_events(np.arange(5, 500, dtype=np.uint64) * (HZ // 1000)), HZ)


def test_long_gap_changes_nothing(library):
    burst = trapezoid_ticks(2000, 20_000, 100_000)
    short, long = (np.concatenate([burst, burst + np.uint64(gap_s * HZ)]) for gap_s in (2, 2000))
    figures = [measure(library, axis_events(ticks), HZ)[0] for ticks in (short, long)]
    assert figures[0].max_accel_steps_s2[0] == pytest.approx(figures[1].max_accel_steps_s2[0], rel=2e-3)
    assert figures[0].max_speed_steps_s[0] == pytest.approx(figures[1].max_speed_steps_s[0], rel=1e-9)


def test_shortest_interval_is_of_one_axis(library):
    trace = events([(1000, 1, 0), (1010, 2, 0), (2000, 1, 0), (2900, 3, 1), (2901, 4, 0)])
    measured, _ = measure(library, trace, HZ)
    assert list(measured.min_interval_ticks) == [900, 1890, 0, 0, 0, 0]


def test_extent_includes_the_start_and_the_turning_points(library):
    trace = events([(1000 * n, 1, int(n > 3)) for n in range(1, 10)])
    measured, _ = measure(library, trace, HZ)
    assert (measured.min_steps[0], measured.max_steps[0], measured.position_steps[0]) == (-3, 3, -3)
    assert measured.steps_total[0] == 9


def test_time_belongs_to_the_later_edge_and_dwell_to_nobody(library):
    trace = events([(1000, 1, 0, RAPID), (3000, 1, 0, RAPID), (3500, 1, 0, 0), (9000, 1, 0, 0, 1), (9300, 1, 0, 0, 1)])
    measured, _ = measure(library, trace, HZ, begin=600)
    assert (measured.rapid_ticks, measured.cutting_ticks) == (400 + 2000, 500 + 300)
    assert (measured.events, measured.last_ticks) == (5, 9300)


def test_nothing(library):
    measured, samples = measure(library, events([]), HZ, sample_ms=1.0)
    assert measured.events == 0 and len(samples) == 0


def test_samples_follow_the_path(library):
    spm = 100.0
    ticks = trapezoid_ticks(10_000, 5000, 20_000)
    _, samples = measure(library, axis_events(ticks, axis=2), HZ, begin=0, steps_per_mm=spm, sample_ms=5.0)
    t = samples["t_s"].astype(float)
    assert t[0] == pytest.approx(ticks[0] / HZ, abs=1e-6)
    assert samples["position_mm"][-1, 2] == pytest.approx(100.0)
    assert np.diff(t)[:-1] == pytest.approx(0.005, abs=1e-5)
    exact = np.interp(t, ticks / HZ, np.arange(1, 10_001) / spm)
    assert samples["position_mm"][:, 2] == pytest.approx(exact, abs=2e-4)
    cruise = (t > 0.3) & (t < 1.9)
    assert samples["speed_mm_s"][cruise] == pytest.approx(50.0, rel=1e-4)


def test_path_speed_is_over_all_axes_and_rapids_are_marked(library):
    trace = events([(n * 2000, 3, 0, RAPID if n > 1000 else 0) for n in range(1, 2001)])
    _, samples = measure(library, trace, HZ, steps_per_mm=100.0, sample_ms=1.0)
    middle = samples[20:-20]
    assert middle["speed_mm_s"] == pytest.approx(100 * np.sqrt(2), rel=1e-5)
    assert (samples["rapid"] == (samples["t_s"] > 0.1)).mean() > 0.99


def test_standstill_costs_nothing(library):
    burst = np.arange(1, 1000, dtype=np.uint64) * 2000
    ticks = np.concatenate([burst + np.uint64(k * 3600 * HZ) for k in range(20)])  # an hour of rest between bursts
    _, samples = measure(library, axis_events(ticks), HZ, sample_ms=1.0)
    assert len(samples) < 20 * 250
    rest = samples[(samples["t_s"] > 1) & (samples["t_s"] < 3599)]
    assert len(rest) == 0


def test_many_samples_are_thinned_not_lost(library):
    ticks = np.arange(1, 1_300_000, dtype=np.uint64) * (HZ // 1000)
    _, samples = measure(library, axis_events(ticks), HZ, sample_ms=1.0)
    assert 500_000 < len(samples) <= 1 << 20
    assert samples["t_s"][0] == pytest.approx(0.001) and samples["t_s"][-1] == pytest.approx(1299.999, abs=0.01)
    assert np.all(np.diff(samples["t_s"]) > 0)
