"""Pictures: what is drawn must be what was run, whatever its shape."""

from __future__ import annotations

import numpy as np
import pytest
from test_sim_job import run
from wificnc.simulator.path import COLUMNS, Path, envelope, isometric, nearness, path_from_samples, runs, simplify
from wificnc.simulator.plot import draw_job

JOBS = {
    "nothing": "M30\n",
    "one rapid": "G0X10\n",
    "one cut": "G1Z-3F200\n",
    "tall": "".join(f"G1X{n % 2}Y{n * 3}F3000\n" for n in range(60)),
    "wide, with $igns and an error": "G1X500F5000\nG1X0Y0.1\nG2X1\n",
    "relief": "".join(f"G1X{n % 2 * 20}Y{n * 0.5}Z{n % 3}F2500\n" for n in range(40)),
    "drill": "".join(f"G0X{n * 4}\nG1Z-2F120\nG0Z1\n" for n in range(6)),
}


def make_path(xyz: np.ndarray, speed: np.ndarray | float = 60.0, rapid: np.ndarray | bool = False) -> Path:
    count = len(xyz)
    return Path(
        np.arange(count) * 1e-3,
        np.asarray(xyz, dtype=float),
        np.broadcast_to(np.asarray(speed, dtype=float), count).copy(),
        np.broadcast_to(np.asarray(rapid), count).copy(),
    )


@pytest.mark.parametrize("name", JOBS)
def test_every_shape_of_job_gives_a_picture(library, name):
    result = run(library, JOBS[name], file=f"{name}.nc", samples=True, travel_mm=(60.0, 60.0, None, None, None, None))
    png = draw_job(result, "png")
    assert png.startswith(b"\x89PNG") and len(png) > 20_000


@pytest.mark.slow
def test_the_same_job_makes_the_same_picture(library):
    result = run(library, JOBS["relief"], samples=True)
    svg = draw_job(result, "svg")
    assert svg == draw_job(result, "svg") and b"<svg" in svg[:1000]


def test_samples_are_the_path(library):
    path = path_from_samples(run(library, "G0X10\nG1Y5F600\n", samples=True).samples)
    assert path.xyz_mm[-1] == pytest.approx([10, 5, 0])
    assert path.top_speed_mm_min == pytest.approx(600, rel=0.02)
    assert path.rapid[1] and not path.rapid[-1]
    assert np.all(np.diff(path.t_s) > 0)


def test_simplify_keeps_the_shape_and_the_colours():
    t = np.linspace(0, 2 * np.pi, 50_001)
    circle = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    speed = np.where(t < np.pi, 600.0, 60.0)
    path = make_path(circle, speed)
    light = simplify(path, 1e-4)
    assert len(light.t_s) < 1000
    radius = np.hypot(*((light.xyz_mm[1:, :2] + light.xyz_mm[:-1, :2]) / 2).T)
    assert radius.min() > 1 - 5e-4
    assert set(light.speed_mm_min) == {600.0, 60.0}
    switch = light.xyz_mm[np.flatnonzero(np.diff(light.speed_mm_min))[0]]
    assert switch == pytest.approx([-1, 0, 0], abs=1e-3)


def test_simplify_makes_a_line_of_a_line():
    path = make_path(np.stack([np.linspace(0, 100, 100_000), np.zeros(100_000), np.zeros(100_000)], axis=1))
    light = simplify(path, 1e-3)
    assert len(light.t_s) < 10 and light.xyz_mm[[0, -1], 0].tolist() == [0.0, 100.0]


def test_simplify_keeps_there_and_back():
    x = np.concatenate([np.linspace(0, 10, 1000), np.linspace(10, 0, 1000)])
    light = simplify(make_path(np.stack([x, 0 * x, 0 * x], axis=1)), 1e-3)
    assert light.xyz_mm[:, 0].max() == 10.0


def test_envelope_keeps_every_extreme():
    rng = np.random.default_rng(3)
    speed = rng.uniform(10, 20, 500_000)
    speed[123_456], speed[400_000] = 99.0, 1.0
    light = envelope(make_path(np.zeros((500_000, 3)), speed))
    assert len(light.t_s) <= 4 * COLUMNS
    assert {99.0, 1.0} <= set(light.speed_mm_min) and np.all(np.diff(light.t_s) > 0)
    assert light.t_s[[0, -1]].tolist() == [0.0, 499_999 * 1e-3]


def test_runs_begin_at_the_point_before():
    mask = np.array([True, True, False, False, True, False, True])
    assert runs(mask) == [(0, 2), (3, 5), (5, 7)]
    assert runs(np.zeros(3, dtype=bool)) == []


def test_isometric_shows_all_axes_in_the_same_length():
    ends = isometric(np.eye(3))
    assert np.linalg.norm(ends, axis=1) == pytest.approx([1.0, 1.0, 1.0])
    assert ends[0, 0] > 0 > ends[0, 1] and ends[1].min() > 0 and ends[2] == pytest.approx([0, 1])
    eye = np.array([1.0, -1.0, 1.0])
    assert isometric(eye) == pytest.approx([0, 0]) and nearness(eye) > 0
