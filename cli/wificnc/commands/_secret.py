"""The type of every option whose value others must not read: the list of processes shows arguments to all users."""

from __future__ import annotations

from typing import Any

import rich_click as click

READ = "Other users of this computer can read arguments."
ASKED = f"- prompts for it. {READ}"


class Secret(click.ParamType):  # type: ignore[type-arg, unused-ignore] # generic in newer releases alone
    """A text; `-` prompts for it without an echo, or reads a line of stdin."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value != "-" or param is None:
            return value
        return click.prompt((param.name or "").replace("_", " "), hide_input=True, err=True)
