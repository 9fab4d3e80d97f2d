"""The page of all commands: what `--help` prints, from the commands themselves. Only the site has it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc

import click
from wificnc.app import GROUPS, root

PAGE = "docs/commands.md"
HEAD = "# Commands\n\nThe same texts as `wificnc COMMAND --help`.\n"
SIGN = re.compile(r"(`[^`]*`)|([<>\[\]*_|])")
OF_DOCS = re.compile(r"\bdocs/([\w/-]+\.md)\b")


def commands_text() -> str:
    """Markdown: a heading for each group, command and command of a command."""
    parts = [HEAD]
    with click.Context(root, info_name="wificnc") as ctx:
        for group, names in GROUPS.items():
            parts.append(f"## {group}\n")
            for name in names:
                command = root.get_command(ctx, name)
                assert command is not None
                parts += _sections(command, name, ctx, "###")
    return "\n".join(parts)


def _sections(command: click.Command, name: str, parent: click.Context, heading: str) -> Iterator[str]:
    ctx = click.Context(command, info_name=name, parent=parent)
    yield f"{heading} {ctx.command_path}\n"
    yield _prose(command.help or "")
    usage = " ".join(command.collect_usage_pieces(ctx))
    yield f"```\n{ctx.command_path} {usage}\n```\n"
    records = [record for param in command.get_params(ctx) if (record := _record(param, ctx))]
    rows = [f"| `{_cell(names)}` | {_cell(_linked(_plain(text)))} |" for names, text in records]
    if rows:
        yield "\n".join(["| option | |", "| --- | --- |", *rows, ""])
    if isinstance(command, click.Group):
        for child in command.list_commands(ctx):
            found = command.get_command(ctx, child)
            if found is not None and not found.hidden:
                yield from _sections(found, child, ctx, heading + "#")


def _record(param: click.Parameter, ctx: click.Context) -> tuple[str, str] | None:
    """Names and text; none for arguments, which the usage has, and for --help."""
    if not isinstance(param, click.Option) or param.name == "help":
        return None
    return click.Option.get_help_record(param, ctx)


def _prose(text: str) -> str:
    """Paragraphs as they are written; those that keep their lines (after a backspace) as a block."""
    parts = cleandoc(text).split("\n\n")
    blocks = (f"```\n{part[1:].strip()}\n```" if part.startswith("\b") else _linked(_plain(part)) for part in parts)
    return "\n\n".join(blocks) + "\n"


def _plain(text: str) -> str:
    """Signs of a help text are no markup, but for code."""
    return SIGN.sub(lambda found: found[1] or f"\\{found[2]}", text)


def _linked(text: str) -> str:
    return OF_DOCS.sub(r"[\1](\1)", text)


def _cell(text: str) -> str:
    """A bar ends a cell even in code."""
    return " ".join(re.sub(r"(?<!\\)\|", r"\|", text).split())
