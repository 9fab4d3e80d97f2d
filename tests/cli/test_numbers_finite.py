"""Options with a number: `nan` passes every limit of a range, and `inf` is larger than what any machine does."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rich_click as click
from click.types import FloatParamType
from wificnc.app import COMMANDS, root
from wificnc.commands._finite import FINITE, FiniteRange


def parameters(command: click.Command, name: str) -> Iterator[tuple[str, click.Parameter]]:
    """Of it and the commands below it, with its whole name."""
    context = click.Context(command)
    if isinstance(command, click.Group):
        for each in COMMANDS if command is root else command.list_commands(context):
            found = command.get_command(context, each)
            assert found is not None
            yield from parameters(found, f"{name} {each}")
    yield from ((f"{name} {parameter.opts[0]}", parameter) for parameter in command.params)


FLOATS = {name: each for name, each in parameters(root, "wificnc") if isinstance(each.type, FloatParamType)}


def test_there_are_some() -> None:
    assert {"wificnc jog --feed", "wificnc send --safe-z", "wificnc tune shaper --spread"} & set(FLOATS)


@pytest.mark.parametrize("name", FLOATS)
@pytest.mark.parametrize("text", ["nan", "-nan", "inf", "-Infinity", "1e999"])
def test_a_number_is_finite(name: str, text: str) -> None:
    with pytest.raises(click.BadParameter):
        FLOATS[name].type.convert(text, FLOATS[name], None)


def test_a_finite_number_is_taken() -> None:
    assert (FINITE.convert("-2.5", None, None), FiniteRange(min=0).convert("1e3", None, None)) == (-2.5, 1000.0)
    with pytest.raises(click.BadParameter, match="range x>=0"):
        FiniteRange(min=0).convert("-1", None, None)
