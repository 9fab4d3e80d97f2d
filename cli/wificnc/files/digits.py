"""Whole numbers that people type: more digits than Python converts are a large number, and no error of Python."""

from __future__ import annotations

import math

DIGITS_MAX = 18
MANY = 10**DIGITS_MAX  # above every limit of ours


def whole_number(digits: str, base: int = 10) -> int:
    """The number; MANY when it has more than 18 digits."""
    digits = digits.lstrip("0") or "0"
    return int(digits, base) if len(digits) <= DIGITS_MAX else MANY


def is_float(number: int | float) -> bool:
    """A float can hold it, and it is finite."""
    try:
        return math.isfinite(number)
    except OverflowError:
        return False
