"""Our own trigonometry against the C library's, by way of Python's math."""

from __future__ import annotations

import math
from ctypes import CDLL, byref, c_double

from hypothesis import given
from hypothesis import strategies as st

ERROR_SIN = 2.3e-16
ERROR_ATAN = 4.5e-16  # a unit in the last place at pi is 4.4e-16


def sincos(lib: CDLL, angle: float) -> tuple[float, float]:
    """trig_sincos()."""
    s, c = c_double(), c_double()
    lib.trig_sincos(angle, byref(s), byref(c))
    return s.value, c.value


def assert_sincos(lib: CDLL, angle: float) -> None:
    s, c = sincos(lib, angle)
    assert abs(s - math.sin(angle)) <= ERROR_SIN
    assert abs(c - math.cos(angle)) <= ERROR_SIN


@given(st.floats(-4 * math.pi, 4 * math.pi))
def test_sine_and_cosine(lib: CDLL, angle: float) -> None:
    assert_sincos(lib, angle)


@given(st.floats(-1e6, 1e6))
def test_sine_and_cosine_after_many_turns(lib: CDLL, angle: float) -> None:
    assert_sincos(lib, angle)


def test_sine_and_cosine_on_a_grid_and_at_the_quadrants(lib: CDLL) -> None:
    for k in range(-20_000, 20_001):
        assert_sincos(lib, k * 4 * math.pi / 20_000)
    for quadrant in range(-64, 65):
        for angle in (quadrant * math.pi / 4, math.nextafter(quadrant * math.pi / 4, 9)):
            assert_sincos(lib, angle)


@given(st.floats(-1e7, 1e7), st.floats(-1e7, 1e7))
def test_arc_tangent(lib: CDLL, y: float, x: float) -> None:
    expected = 0.0 if x == y == 0.0 else math.atan2(y + 0.0, x)
    assert abs(lib.trig_atan2(y, x) - expected) <= ERROR_ATAN


def test_arc_tangent_all_around(lib: CDLL) -> None:
    for k in range(-20_000, 20_001):
        angle = k * math.pi / 20_000
        y, x = math.sin(angle), math.cos(angle)
        assert abs(lib.trig_atan2(y, x) - math.atan2(y, x)) <= ERROR_ATAN


def test_arc_tangent_on_the_axes_is_exact(lib: CDLL) -> None:
    for y, x in ((0, 1), (1, 0), (-1, 0), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        assert lib.trig_atan2(y, x) == math.atan2(y, x)
    assert lib.trig_atan2(0, 0) == 0
