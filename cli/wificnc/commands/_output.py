"""The type of every option that names a file to be written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import rich_click as click

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
