"""What the commands take."""

from __future__ import annotations

from collections.abc import Iterator

import rich_click as click


def parameters(group: click.Command, name: str = "") -> Iterator[tuple[str, click.Parameter]]:
    """All commands with all their parameters."""
    context = click.Context(group)
    if isinstance(group, click.Group):
        for child in group.list_commands(context):
            command = group.get_command(context, child)
            assert command
            yield from parameters(command, f"{name} {child}".strip())
    for parameter in group.params:
        yield name, parameter
