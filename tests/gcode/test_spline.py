"""G5 and G5.1 as LinuxCNC's reference describes them: XY only, control points by their distance from the ends."""

from __future__ import annotations

import ctypes
import itertools
import math

import pytest
from gcode_core import Axes, Controller, Move, Spline
from hypothesis import given
from hypothesis import strategies as st

Point = tuple[float, float]


def points(lib: ctypes.CDLL, start: list[float], move: Move, tolerance: float) -> list[list[float]]:
    spline, point, found = Spline(), Axes(), []
    lib.spline_begin(ctypes.byref(spline), Axes(*start), ctypes.byref(move), tolerance)
    while lib.spline_next(ctypes.byref(spline), point):
        found.append(list(point))
    return found


def casteljau(curve: list[Point], t: float) -> Point:
    """A Bezier curve of any degree by repeated division: independent of the polynomial."""
    while len(curve) > 1:
        curve = [(a + (c - a) * t, b + (d - b) * t) for (a, b), (c, d) in itertools.pairwise(curve)]
    return curve[0]


def off_line(point: Point, start: list[float], end: list[float]) -> float:
    x, y = end[0] - start[0], end[1] - start[1]
    size = math.hypot(x, y)
    if size == 0:
        return math.dist(point, start[:2])
    part = max(0.0, min(1.0, ((point[0] - start[0]) * x + (point[1] - start[1]) * y) / size**2))
    return math.dist(point, (start[0] + part * x, start[1] + part * y))


NUMBER = st.integers(-5000, 5000).map(lambda n: n / 100)


@given(st.tuples(*[NUMBER] * 6), st.sampled_from([0.002, 0.1]))
def test_a_cubic_stays_within_the_tolerance(lib: ctypes.CDLL, words: tuple[float, ...], tolerance: float) -> None:
    i, j, p, q, x, y = words
    cnc = Controller(lib)
    cnc.run("F100", "G0X1Y2Z3")
    move = cnc.resolve(f"G5I{i}J{j}P{p}Q{q}X{x}Y{y}")[1].move
    found = points(lib, [1, 2, 3, 0, 0, 0], move, tolerance)
    assert found[-1] == list(move.target_mm) == [x, y, 3, 0, 0, 0]
    curve = [(1, 2), (1 + i, 2 + j), (x + p, y + q), (x, y)]
    chain = [[1.0, 2.0, 3.0], *found]
    step = 1 + len(found) // 30
    for n in range(0, len(found), step):
        for inner in (0, 0.25, 0.5, 0.75):
            exact = casteljau(curve, (n + inner) / len(found))
            assert off_line(exact, chain[n], chain[n + 1]) <= tolerance * (1 + 1e-6) + 1e-9


@given(st.tuples(*[NUMBER] * 4))
def test_a_quadratic_is_its_cubic(lib: ctypes.CDLL, words: tuple[float, ...]) -> None:
    i, j, x, y = words
    cnc = Controller(lib)
    cnc.run("F100")
    status, command = cnc.resolve(f"G5.1X{x}Y{y}I{i}J{j}")
    assert status == (35 if i == j == 0 else 0)
    if status:
        return
    found = points(lib, [0.0] * 6, command.move, 0.01)
    for n in range(1, len(found), 1 + len(found) // 30):
        exact = casteljau([(0, 0), (i, j), (x, y)], n / len(found))
        assert math.dist(found[n - 1][:2], exact) < 1e-9


@given(st.tuples(*[NUMBER] * 4))
def test_no_point_lies_outside_the_control_points(lib: ctypes.CDLL, words: tuple[float, ...]) -> None:
    """A curve along the end of the travel stays inside of it, to the last bit."""
    x, j, q, y = words
    cnc = Controller(lib)
    cnc.run("F100", f"G0X{x}")
    move = cnc.resolve(f"G5I0J{j}P0Q{q}X{x}Y{y}")[1].move
    for point in points(lib, [x, 0, 0, 0, 0, 0], move, 0.01):
        assert point[0] == x
        assert min(0, j, y + q, y) <= point[1] <= max(0, j, y + q, y)


def test_without_i_and_j_it_goes_on_smoothly(cnc: Controller) -> None:
    """`I and J default to the negative of P and Q of the previous G5`."""
    cnc.run("F100", "G5I0J3P0Q-3X1Y1")
    move = cnc.run("G5P0Q-2X2Y2").move
    assert list(move.control_mm[0]) == [1, 1 + 3] and list(move.control_mm[1]) == [2, 2 - 2]
    move = cnc.run("G91G5P0Q-1X1Y1").move
    assert list(move.control_mm[0]) == [2, 2 + 2] and list(move.control_mm[1]) == [3, 3 - 1]


def test_inches_and_offsets(cnc: Controller) -> None:
    move = cnc.run("F100", "G10L2P1X10", "G20", "G5X1Y0I1J1P-1Q1").move
    assert list(move.target_mm)[:2] == pytest.approx([35.4, 0])
    assert list(move.control_mm[0]) == pytest.approx([25.4, 25.4])
    assert list(move.control_mm[1]) == pytest.approx([10, 25.4])


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G5X1Y1P0Q1", 28),  # the first one needs I J
        ("G5X1Y1I1P0Q1", 28),
        ("G5X1Y1I1J1P0", 28),
        ("G5X1Y1I1J1", 28),
        ("G5I1J1P1Q1", 26),
        ("G5X1Z1I1J1P1Q1", 31),
        ("G18G5X1I1J1P1Q1", 20),
        ("G93G5X1I1J1P1Q1F1", 20),
        ("G5X1I200000J1P1Q1", 33),
        ("G5X1I1J1P1Q1K1", 36),
        ("P-1G5X1I1J1Q1", 4),  # G5 is in front of a negative P
        ("G4P-1", 4),
        ("G5.1X1P-1I1", 4),
        ("G5.1X1P1I1", 36),
        ("G5.1X1", 35),
        ("G5.1X1I0J0", 35),
        ("G5.2", 20),
        ("G53G5X1I1J1P1Q1", 30),
    ],
)
def test_errors_change_nothing(cnc: Controller, line: str, answer: int) -> None:
    cnc.run("F100")
    before = bytes(cnc.state)
    assert cnc.answer(line) == answer
    assert bytes(cnc.state) == before
