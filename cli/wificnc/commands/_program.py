"""What the commands that run programs with O words share."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import rich_click as click
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from wificnc import ui
from wificnc.job.expand import LINES_MAX
from wificnc.simulator.job import Progress as OnProgress

max_lines_option = click.option(
    "--max-lines", type=click.IntRange(min=1, max=2**32 - 1), default=LINES_MAX, show_default=True, metavar="N",
    help="Maximum lines that a program with O words may execute (stops endless loops).",
)  # fmt: skip


@contextmanager
def progress_bar(name: str) -> Iterator[OnProgress | None]:
    """A bar on a terminal, nothing elsewhere; it leaves no trace."""
    if not sys.stderr.isatty():
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("lines"))
    with Progress(*columns, TimeElapsedColumn(), console=ui.talk, transient=True) as bar:
        task = bar.add_task(escape(name), total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
