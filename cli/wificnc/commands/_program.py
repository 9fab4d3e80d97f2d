"""What the commands that run programs with O words share."""

from __future__ import annotations

import rich_click as click

from wificnc.job.expand import LINES_MAX

max_lines_option = click.option(
    "--max-lines", type=click.IntRange(min=1, max=2**32 - 1), default=LINES_MAX, show_default=True, metavar="N",
    help="Lines that a program with O words may execute, against endless loops.",
)  # fmt: skip
