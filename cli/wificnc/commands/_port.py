"""What commands that reach a chip over USB have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rich_click as click
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn

from wificnc import ui
from wificnc.firmware.flash.device import Device, open_device
from wificnc.firmware.flash.ports import choose_port, usb_ports

port_option = click.option(
    "--port", envvar="WIFICNC_PORT", show_envvar=True, metavar="PORT",
    help="Serial port of the board; default: the only one found.",
)  # fmt: skip


@contextmanager
def connected(port: str | None) -> Iterator[Device]:
    """The chip at the port, or at the only one. Raises FlashError."""
    device = choose_port(port, usb_ports())
    ui.note(f"port      {device}")
    with open_device(device) as opened:
        yield opened


@contextmanager
def progress_bars() -> Iterator[Callable[[str, int, int], None]]:
    """A bar for each thing that is written; without a terminal one line for each."""
    columns = (TextColumn("{task.description:<16}"), BarColumn(), DownloadColumn())
    bars = Progress(*columns, console=ui.talk, disable=not ui.talk.is_terminal)
    tasks: dict[str, Any] = {}

    def show(name: str, done: int, total: int) -> None:
        if name not in tasks:
            tasks[name] = bars.add_task(name, total=total)
        bars.update(tasks[name], completed=done)
        if done >= total and not ui.talk.is_terminal:
            ui.note(f"{name}: {total:,} bytes")

    with bars:
        yield show
