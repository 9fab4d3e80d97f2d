"""The type of every option that names a file to be written."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import rich_click as click

from wificnc.errors import UserError
from wificnc.output import STDOUT, why_not_writable


class OutputFile(click.Path):
    """A path that can be written, or `-`, which is stdout where the command can write to it.

    What is wrong is found before the command does anything.
    """

    def __init__(self, stdout: bool = True, makes_folders: bool = False) -> None:
        super().__init__(path_type=Path)
        self._stdout = stdout
        self._makes_folders = makes_folders

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = Path(value)
        if path == STDOUT:
            if not self._stdout:
                self.fail("- is stdout, and this option needs a file name", param, ctx)
        elif why := why_not_writable(path, self._makes_folders):
            self.fail(f"cannot write {path}: {why}", param, ctx)
        return path


class OutputFolder(click.Path):
    """A folder that is there or can be made."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = Path(value)
        if path == STDOUT:
            self.fail("- is stdout, and this option needs a folder name", param, ctx)
        if path.exists() and not path.is_dir():
            self.fail(f"{path} exists and is not a folder", param, ctx)
        if not path.is_dir() and (why := why_not_writable(path, makes_folders=True)):
            self.fail(f"cannot make the folder {path}: {why}", param, ctx)
        return path


def keep_inputs(command: click.Command) -> None:
    """Have it, and the commands below it, refuse an output that it reads, or that is another of its outputs, before it
    does anything."""
    if isinstance(command, click.Group):
        for each in command.commands.values():
            keep_inputs(each)
    elif command.callback and not hasattr(command.callback, "keeps_inputs"):
        callback = command.callback

        @functools.wraps(callback)
        def checked(*args: Any, **named: Any) -> Any:
            if ctx := click.get_current_context():
                _refuse_overwriting(ctx)
            return callback(*args, **named)

        command.callback = checked
        checked.keeps_inputs = True  # type: ignore[attr-defined]


def _refuse_overwriting(ctx: click.Context) -> None:
    files = list(_files(ctx))
    for at, (output, path) in enumerate(files):
        others = [each for each, other in (*files[:at], *files[at + 1 :]) if other.resolve() == path.resolve()]
        if isinstance(output.type, OutputFile) and others:
            used = "an output" if all(isinstance(each.type, OutputFile) for each in others) else "read by the command"
            raise UserError(
                f"{output.opts[-1]} {path}: the command has that file {used}, too", hint="name another file"
            )


def _files(ctx: click.Context) -> Iterator[tuple[click.Parameter, Path]]:
    """What parameters name: files that are there, and outputs. A device is no file."""
    for parameter in ctx.command.params:
        value = ctx.params.get(parameter.name or "")
        for each in value if isinstance(value, tuple) else (value,):
            is_output = isinstance(parameter.type, OutputFile) and isinstance(each, Path) and each != STDOUT
            if isinstance(each, (str, Path)) and (Path(each).is_file() or (is_output and not Path(each).exists())):
                yield parameter, Path(each)
