"""Tests that `make test` leaves to `make test-all`: dear ones, whose kind of fault a quick test sees, too.

The marker is `slow`. It is the command that leaves them out, not pytest's configuration: a file that is run by its name
runs whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import pytest

Value = TypeVar("Value")


def slow_but(is_quick: Callable[[Value], bool], values: Iterable[Value]) -> list[Any]:
    """Parameters of a test, of which `make test` runs the quick ones."""
    found = list(values)
    quick = [value for value in found if is_quick(value)]
    assert quick, "a quick test of it must stay"
    return [value if value in quick else pytest.param(value, marks=pytest.mark.slow) for value in found]
