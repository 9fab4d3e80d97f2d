"""Exponential, logarithm and power against Python's, which are the C library's."""

from __future__ import annotations

import math
from ctypes import CDLL, c_double

import pytest
from hypothesis import given
from hypothesis import strategies as st


@pytest.fixture(scope="module")
def power(lib: CDLL) -> CDLL:
    for name, count in (("power_exp", 1), ("power_ln", 1), ("power_raise", 2)):
        getattr(lib, name).restype = c_double
        getattr(lib, name).argtypes = (c_double,) * count
    return lib


@given(st.floats(-700, 709))
def test_exp_is_within_4e16(power: CDLL, x: float) -> None:
    assert power.power_exp(x) == pytest.approx(math.exp(x), rel=4e-16, abs=0)


@given(st.floats(1e-300, 1e300))
def test_ln_is_within_4e16(power: CDLL, x: float) -> None:
    assert power.power_ln(x) == pytest.approx(math.log(x), rel=4e-16, abs=2e-16)


@given(st.floats(0.5, 2.0))
def test_ln_near_one(power: CDLL, x: float) -> None:
    assert power.power_ln(x) == pytest.approx(math.log(x), rel=4e-16, abs=2e-16)


@given(st.floats(-1e5, -1e-5) | st.floats(1e-5, 1e5), st.integers(-3, 3))
def test_small_whole_powers(power: CDLL, base: float, exponent: int) -> None:
    assert power.power_raise(base, exponent) == pytest.approx(base**exponent, rel=4e-16, abs=0)


@given(st.floats(1e-5, 1e5), st.floats(-60, 60))
def test_powers(power: CDLL, base: float, exponent: float) -> None:
    assert power.power_raise(base, exponent) == pytest.approx(base**exponent, rel=2e-13, abs=5e-324)


def test_the_ends_of_the_range(power: CDLL) -> None:
    assert power.power_exp(0.0) == 1.0
    assert power.power_ln(1.0) == 0.0
    assert power.power_exp(1e300) == math.inf
    assert power.power_exp(-1e300) == 0.0
    assert power.power_raise(0.0, 0.0) == 1.0
    assert power.power_raise(0.0, 2.5) == 0.0
    assert power.power_raise(0.0, -1.0) == math.inf
    assert power.power_raise(-2.0, 3.0) == -8.0
    assert power.power_raise(-2.0, 1e9) == math.inf
    assert power.power_raise(10.0, 400.0) == math.inf
    assert power.power_raise(10.0, -400.0) == 0.0
