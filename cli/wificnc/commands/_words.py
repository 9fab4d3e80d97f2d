"""Axis words on the command line: X10, y-2.5."""

from __future__ import annotations

import re

import rich_click as click

_WORD = re.compile(r"([XYZABC])=?([-+]?(?:\d+\.?\d*|\.\d+))")


def axis_word(value: str) -> str:
    """y=-2.5 -> Y-2.5. Raises BadParameter."""
    match = _WORD.fullmatch(value.upper())
    if match is None:
        raise click.BadParameter(f"{value!r} is not an axis with a number, like X10 or Z-0.5")
    return match[1] + match[2]


def one_axis(ctx: click.Context, param: click.Parameter, value: str) -> str:
    return axis_word(value)


def some_axes(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """At most one word of each axis."""
    words = tuple(axis_word(value) for value in values)
    if len({word[0] for word in words}) < len(words):
        raise click.BadParameter("an axis is given twice")
    return words
