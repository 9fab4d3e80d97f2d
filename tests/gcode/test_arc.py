"""Arcs against exact geometry: points on the circle or helix, evenly, within tolerance, to the very end."""

from __future__ import annotations

import math
from ctypes import CDLL
from dataclasses import dataclass
from itertools import pairwise

import pytest
from gcode_core import ARC_CCW, ARC_CW, Axes, Controller, Move, arc_points, begin_arc
from hypothesis import given
from hypothesis import strategies as st

PLANES = [(0, 1), (2, 0), (1, 2)]
ON_THE_CIRCLE_MM = 1e-9


@dataclass
class Shape:
    """An arc as geometry has it."""

    plane: int
    center: tuple[float, float]
    radius: float
    growth: float  # of the radius, start to end
    start_rad: float
    travel_rad: float
    start: list[float]
    target: list[float]

    @property
    def move(self) -> Move:
        motion = ARC_CCW if self.travel_rad > 0 else ARC_CW
        return Move(motion=motion, target_mm=Axes(*self.target), plane=self.plane, center_mm=self.center)

    def point(self, part: float) -> list[float]:
        """The exact point after part of the travel."""
        radius, angle = self.radius + self.growth * part, self.start_rad + self.travel_rad * part
        point = [a + (b - a) * part for a, b in zip(self.start, self.target, strict=True)]
        ax0, ax1 = PLANES[self.plane]
        point[ax0] = self.center[0] + radius * math.cos(angle)
        point[ax1] = self.center[1] + radius * math.sin(angle)
        return point


def shape(
    plane: int,
    radius: float,
    start_rad: float,
    travel_rad: float,
    growth: float = 0,
    others: float = 0,
    center: float = 0,
) -> Shape:
    """A shape whose other axes move by others, 2 others, ..."""
    made = Shape(plane, (center, -center), radius, growth, start_rad, travel_rad, [0.0] * 6, [0.0] * 6)
    made.start = [10.0 * ax for ax in range(6)]
    made.target = [10.0 * ax + others * (ax + 1) for ax in range(6)]
    made.start, made.target = made.point(0), made.point(1)
    return made


SHAPES = st.builds(
    shape,
    plane=st.integers(0, 2),
    radius=st.floats(0.01, 1e5),
    start_rad=st.floats(-math.pi, math.pi),
    travel_rad=st.floats(0.01, 6.27) | st.floats(-6.27, -0.01),
    growth=st.floats(-0.005, 0.005),
    others=st.floats(-50, 50),
    center=st.floats(-1000, 1000),
)


@given(SHAPES, st.floats(0.0005, 1))
def test_points_are_exact(lib: CDLL, arc: Shape, tolerance: float) -> None:
    run = begin_arc(lib, arc.start, arc.move, tolerance)
    points = list(arc_points(lib, run))
    assert len(points) == run.chords
    assert points[-1] == arc.target, "the last point is the target itself"
    start_error = 1e-10 + 2 * arc.radius * 1e-15  # of the shape itself: its start and target are rounded
    for k in range(1, len(points) + 1, 1 + len(points) // 300):
        exact = arc.point(k / len(points))
        assert math.dist(points[k - 1][:3], exact[:3]) <= ON_THE_CIRCLE_MM + start_error
        assert points[k - 1][3:] == pytest.approx(exact[3:], abs=1e-9)


@given(SHAPES, st.floats(0.0005, 1))
def test_chords_stay_within_the_tolerance_and_are_not_too_many(lib: CDLL, arc: Shape, tolerance: float) -> None:
    chords = begin_arc(lib, arc.start, arc.move, tolerance).chords
    radius = max(arc.radius, arc.radius + arc.growth)
    deviation = radius * (1 - math.cos(arc.travel_rad / chords / 2))
    assert deviation <= tolerance * (1 + 1e-6) + 1e-12 * radius
    widest = 2 * math.acos(1 - min(tolerance, radius) / radius)
    spiral = abs(arc.growth * arc.travel_rad) / (4 * min(tolerance, radius))
    assert chords <= math.ceil(math.sqrt((1.6 * arc.travel_rad / widest) ** 2 + spiral))
    if tolerance < radius / 100:
        assert chords <= math.sqrt((1.01 * arc.travel_rad / widest) ** 2 + spiral) + 1


def distance(point: list[float], start: list[float], end: list[float]) -> float:
    """Of a point from the line between two others."""
    along = [b - a for a, b in zip(start, end, strict=True)]
    part = sum((p - a) * d for p, a, d in zip(point, start, along, strict=True)) / sum(d * d for d in along)
    return math.dist(point, [a + part * d for a, d in zip(start, along, strict=True)])


@given(
    radius=st.floats(0.5, 200),
    growth=st.floats(-0.5, 0.5),
    start=st.floats(-3, 3),
    travel=st.floats(0.01, 6.2) | st.floats(-6.2, -0.01),
    tolerance=st.sampled_from([0.002, 0.05]),
)
def test_a_spiral_stays_within_the_tolerance(
    lib: CDLL, radius: float, growth: float, start: float, travel: float, tolerance: float
) -> None:
    """$41: the radius changes evenly with the angle, and no chord leaves that curve by more than $12."""
    arc = shape(0, radius, start, travel, growth * radius)
    run = begin_arc(lib, arc.start, arc.move, tolerance)
    points = [arc.start, *arc_points(lib, run)]
    for n in range(0, run.chords, 1 + run.chords // 40):
        for inner in (0.25, 0.5, 0.75):
            exact = arc.point((n + inner) / run.chords)
            assert distance(exact[:2], points[n][:2], points[n + 1][:2]) <= tolerance * 1.05


@given(SHAPES)
def test_length(lib: CDLL, arc: Shape) -> None:
    length = lib.arc_length_mm(begin_arc(lib, arc.start, arc.move, 0.01))
    pieces = 1000
    points = [arc.point(k / pieces)[:3] for k in range(pieces + 1)]
    measured = sum(math.dist(a, b) for a, b in pairwise(points))
    assert length == pytest.approx(measured, rel=2e-6 + (arc.growth / arc.radius) ** 2 / 8)


@pytest.mark.parametrize("radius", [1.0, 100.0, 1e5])
def test_a_hundred_thousand_chords_do_not_drift(lib: CDLL, radius: float) -> None:
    arc = shape(0, radius, 0.3, -6.2)
    tolerance = max(1e-6, radius * (6.2 / 100_000) ** 2 / 8)
    run = begin_arc(lib, arc.start, arc.move, tolerance)
    assert run.chords > 2000
    for k, point in enumerate(arc_points(lib, run), 1):
        assert math.dist(point[:2], arc.point(k / run.chords)[:2]) <= ON_THE_CIRCLE_MM


@pytest.mark.parametrize("motion", [ARC_CW, ARC_CCW])
@pytest.mark.parametrize("off", [0.0, 1e-13, -1e-13, 9e-7])
def test_end_on_start_is_a_full_circle(lib: CDLL, motion: int, off: float) -> None:
    move = Move(motion=motion, target_mm=Axes(10, off, 5), center_mm=(0, 0))
    run = begin_arc(lib, [10, 0, 0, 0, 0, 0], move, 0.01)
    assert abs(run.travel_rad) == pytest.approx(2 * math.pi, abs=1e-7)
    assert (run.travel_rad > 0) == (motion == ARC_CCW)
    points = list(arc_points(lib, run))
    assert min(x for x, *_ in points) == pytest.approx(-10, abs=0.02)
    assert points[-1][:3] == [10, off, 5]


def test_a_short_arc_of_a_large_radius_is_no_full_circle(lib: CDLL) -> None:
    """0.4 mm of a 1 km radius are 4e-7 rad: Grbl 1.1h drives the whole circle."""
    arc = shape(0, 1e6, 0, 4e-7)
    run = begin_arc(lib, arc.start, arc.move, 0.002)
    assert run.travel_rad == pytest.approx(4e-7, rel=1e-6)


def test_whole_turns_are_added(lib: CDLL) -> None:
    for travel in (1.0, -1.0):
        arc = shape(1, 10, 0, travel, others=3)
        move = arc.move
        move.turns = 2
        run = begin_arc(lib, arc.start, move, 0.01)
        assert run.travel_rad == pytest.approx(travel + math.copysign(4 * math.pi, travel))
        assert list(arc_points(lib, run))[-1] == arc.target


@pytest.mark.parametrize("radius", [0.0, 1e-9, 1e-6, 0.001])
@pytest.mark.parametrize("tolerance", [0.0, 1e-9, 0.002, 1e9])
def test_tiny_circles_end_too(lib: CDLL, radius: float, tolerance: float) -> None:
    move = Move(motion=ARC_CW, target_mm=Axes(radius, 0, 1), center_mm=(0, 0))
    points = list(arc_points(lib, begin_arc(lib, [radius, 0, 0, 0, 0, 0], move, tolerance)))
    assert 0 < len(points) < 1000
    assert points[-1][:3] == [radius, 0, 1]
    assert all(math.isfinite(value) for point in points for value in point)


def test_nothing_comes_after_the_end(lib: CDLL) -> None:
    arc = shape(0, 5, 0, 1)
    run = begin_arc(lib, arc.start, arc.move, 0.01)
    assert list(arc_points(lib, run))
    assert list(arc_points(lib, run)) == []


@given(
    st.sampled_from(["G2", "G3"]),
    st.sampled_from([("G17", "XY", "IJ"), ("G18", "ZX", "KI"), ("G19", "YZ", "JK")]),
    st.floats(-3.1, 3.1),
    st.floats(0.1, 6.1),
    st.integers(1, 200),
)
def test_text_to_points(
    lib: CDLL, code: str, plane: tuple[str, str, str], start: float, travel: float, radius: int
) -> None:
    """From a line of CAM with three decimals to points: both ends programmed, all between them on the circle."""
    cnc = Controller(lib)
    name, (a, b), (i, j) = plane
    end = start + (travel if code == "G3" else -travel)
    x0, y0 = (round(radius * f(start), 3) for f in (math.cos, math.sin))
    x1, y1 = (round(radius * f(end), 3) for f in (math.cos, math.sin))
    cnc.run("F1000", f"{name}G0{a}{x0:.3f}{b}{y0:.3f}")
    before = list(cnc.state.position_mm)
    move = cnc.run(f"{code}{a}{x1:.3f}{b}{y1:.3f}{i}{-x0:.3f}{j}{-y0:.3f}").move
    points = list(arc_points(lib, begin_arc(lib, before, move, 0.002)))
    ax0, ax1 = ("XYZ".index(axis) for axis in (a, b))
    assert (points[-1][ax0], points[-1][ax1]) == (x1, y1)
    middle = points[len(points) // 2 - 1]
    part = (len(points) // 2) / len(points)
    angle = start + (end - start) * part
    if len(points) > 1:
        assert math.hypot(middle[ax0], middle[ax1]) == pytest.approx(radius, abs=0.001)
        assert math.dist((middle[ax0], middle[ax1]), (radius * math.cos(angle), radius * math.sin(angle))) < 0.003


@pytest.mark.parametrize(
    ("tolerance", "line", "answer"),
    [
        (0, "G2X10.02Y0I5", 33),  # Grbl: 0.005 mm always, up to 0.5 mm if that is 0.1 % of the radius
        (0, "G2X10.004Y0I5", 0),
        (0.021, "G2X10.02Y0I5", 0),
        (0.01, "G2X10.02Y0I5", 33),
        (4, "G2X12.5Y0I5", 0),
        (4, "G2X12.6Y0I5", 33),  # more than half the radius is no circle
        (4, "G2X1Y0I0J0", 33),
    ],
)
def test_radii_that_differ(cnc: Controller, tolerance: float, line: str, answer: int) -> None:
    """Grbl's rule by default; $41 widens it, and the arc ends exactly at the programmed point."""
    cnc.run("F100")
    cnc.state.arc_radius_tolerance_mm = tolerance
    status, command = cnc.resolve(line)
    assert status == answer
    if status == 0:
        *_, last = arc_points(cnc.lib, begin_arc(cnc.lib, [0.0] * 6, command.move, 0.002))
        assert last == list(command.move.target_mm)
