"""Options that have an effect only with, or without, another one: given all the same, they are refused."""

from __future__ import annotations

import rich_click as click
from click.core import ParameterSource

from wificnc.errors import UserError


def refuse_given(ctx: click.Context, names: tuple[str, ...], why: str, hint: str | None = None) -> None:
    """Raises UserError: one of these parameters is on the command line. @param why  follows the option's name"""
    options = {parameter.name: max(parameter.opts, key=len) for parameter in ctx.command.params}
    given = [name for name in names if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    if given:
        raise UserError(f"{', '.join(options[name] for name in given)} {why}", hint)
