"""Dear tests, whose kind of fault a quicker test sees, too: those marked `deep`, which CI leaves to its slices
(tools/dev.py test-slice), and those marked `slow`, which are deep in the ring core and run in CI in the others.

It is the command that leaves them out, not pytest's configuration: a file that is run by its name runs whole.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from itertools import product
from typing import Any, TypeVar

import pytest

Value = TypeVar("Value")


def slow_but(
    is_quick: Callable[[Value], bool], values: Iterable[Value], is_kept: Callable[[Value], bool] = lambda _: True
) -> list[Any]:
    """Parameters of a test: the quick ones, those that are slow, and those that not even so are kept."""
    found = list(values)
    assert any(map(is_quick, found)), "a quick test of it must stay"
    return [value if is_quick(value) else _marked("slow" if is_kept(value) else "deep", value) for value in found]


def deep_but(is_kept: Callable[[Value], bool], values: Iterable[Value]) -> list[Any]:
    """Parameters of a test, of which CI runs some."""
    return slow_but(is_kept, values, lambda _: False)


def cases_but(is_kept: Callable[..., bool], *values: Collection[Any]) -> list[Any]:
    """All combinations of these parameters, of which CI runs some, with every value among them."""
    every = list(product(*values))
    kept = [case for case in every if is_kept(*case)]
    for number, value in ((n, each) for n, column in enumerate(values) for each in column):
        assert any(case[number] == value for case in kept), f"{value}: no case of it is kept"
    return [pytest.param(*case, marks=() if case in kept else pytest.mark.deep) for case in every]


def _marked(mark: str, value: object) -> Any:
    return pytest.param(value, marks=getattr(pytest.mark, mark))
