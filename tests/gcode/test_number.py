"""Decimal text -> double against Python's Decimal and float."""

from __future__ import annotations

import ctypes
import math
import re
from ctypes import CDLL, byref, c_double
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

GRAMMAR = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)", re.ASCII)
LIMIT = Decimal(10) ** 18

DECIMALS = st.from_regex(r"[+-]?([0-9]{1,20}(\.[0-9]{0,30})?|\.[0-9]{1,30})", fullmatch=True)
GARBAGE = st.text("+-.0123456789eExX ()naif", max_size=30) | st.text(st.characters(min_codepoint=1, max_codepoint=255))


def read(lib: CDLL, text: str) -> tuple[float, int] | None:
    """Value and length of the number at the start of text; None if there is none."""
    buffer = ctypes.create_string_buffer(text.encode("latin-1"))
    value = c_double(math.nan)
    end = lib.number_read(buffer, byref(value))
    if end is None:
        assert math.isnan(value.value), "the value must be unchanged"
        return None
    return value.value, end - ctypes.addressof(buffer)


def significant_digits(text: str) -> int:
    """Digits from the first that is not 0, trailing zeros too."""
    return len(re.sub(r"[^0-9]", "", text).lstrip("0"))


@given(st.from_regex(r"[+-]?([0-9]{1,9}(\.[0-9]{0,6})?|\.[0-9]{1,15})", fullmatch=True))
def test_fifteen_digits_are_correctly_rounded(lib: CDLL, text: str) -> None:
    value, length = read(lib, text) or (math.nan, 0)
    assert (value, length) == (float(text), len(text))
    assert math.copysign(1, value) == math.copysign(1, float(text))


@given(DECIMALS)
def test_long_numbers_are_within_an_ulp_or_the_22nd_decimal(lib: CDLL, text: str) -> None:
    exact = Decimal(text)
    result = read(lib, text)
    if abs(exact) >= LIMIT:
        assert result is None
        return
    value, length = result or (math.nan, 0)
    assert length == len(text)
    assert abs(Decimal(value) - exact) <= abs(exact) * Decimal(2) ** -52 + Decimal(10) ** -22
    if significant_digits(text) <= 15 and len(text.partition(".")[2]) <= 22:
        assert value == float(text)


@given(GARBAGE)
def test_the_grammar_is_grbls(lib: CDLL, text: str) -> None:
    found = GRAMMAR.match(text)
    if not found or abs(Decimal(found[0])) >= LIMIT:
        assert read(lib, text) is None
    else:
        value, length = read(lib, text) or (math.nan, 0)
        assert length == len(found[0])
        assert math.isfinite(value)


@pytest.mark.parametrize(
    "text", ["", "+", "-", ".", "-.", "+-1", "--1", "e1", "nan", "inf", "x10", " 1", "1" + "0" * 18]
)
def test_no_number(lib: CDLL, text: str) -> None:
    assert read(lib, text) is None


@pytest.mark.parametrize(
    ("text", "value", "length"),
    [
        ("0", 0.0, 1),
        ("5.", 5.0, 2),
        (".5", 0.5, 2),
        ("1e2", 1.0, 1),
        ("0x10", 0.0, 1),
        ("1.2.3", 1.2, 3),
        ("999999999999999999", 999999999999999999.0, 18),
        ("999999999999999999.9", 999999999999999999.0, 20),
        ("0" * 70 + "1.5", 1.5, 73),
        ("." + "0" * 21 + "1", 1e-22, 23),
        ("." + "0" * 22 + "1", 0.0, 24),
        ("0.1" + "0" * 60, 0.1, 63),
        ("123456789012345678" + "." + "9" * 40, 123456789012345678.0, 59),
    ],
)
def test_edge(lib: CDLL, text: str, value: float, length: int) -> None:
    assert read(lib, text) == (value, length)
