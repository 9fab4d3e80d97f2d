"""`--on-chip [IMAGE]` of the commands that run a board's real image."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import rich_click as click

F = TypeVar("F", bound=Callable[..., object])


def on_chip_option(what: str) -> Callable[[F], F]:
    """None: not on a chip; "": the image that was built. docs/espsim.md."""
    return click.option(
        "--on-chip",
        is_flag=False,
        flag_value="",
        default=None,
        metavar="[IMAGE]",
        help=f"{what} IMAGE: a folder of `wificnc build`, a merged image or an application; without: what was built.",
    )


def chip_image(value: str) -> Path | None:
    """Raises nothing: what is not there is refused by who reads it."""
    return Path(value) if value else None
