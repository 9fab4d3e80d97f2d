"""`wificnc linuxcnc`: configurations for LinuxCNC."""

from __future__ import annotations

import re
from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.errors import UserError
from wificnc.linuxcnc.config import files
from wificnc.machine import load_machine


@click.group()
def command() -> None:
    """LinuxCNC on a controller: docs/linuxcnc.md."""


@command.command()
@click.argument("machine")
@click.option("--to", "address", envvar="WIFICNC_WMC3", show_envvar=True, required=True, help="IPv4 of the device.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder; default: ~/linuxcnc/configs/MACHINE.")
@click.option(
    "--home/--no-home", "homes", default=None, help="The controller homes to switches; default: what the profile says."
)
@click.option("--force", is_flag=True, help="Write over files that are there.")
def init(machine: str, address: str, out: Path | None, homes: bool | None, force: bool) -> None:
    """Write a configuration (INI, HAL, tool table) for MACHINE, the name or file of a machine profile."""
    name = re.sub(r"\W", "_", Path(machine).stem)
    folder = out or Path.home() / "linuxcnc" / "configs" / name
    try:
        texts = files(name, address, load_machine(machine), homes)
    except ValueError as err:
        raise UserError(f"{machine}: {err}") from err
    there = [path for path in texts if (folder / path).exists()]
    if there and not force:
        raise UserError(f"{folder / there[0]} is there already", hint="--force writes over it, --out elsewhere")
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        (folder / path).write_text(text, encoding="utf-8")
    ui.data.print(f"{folder / name}.ini")
    ui.note(f"start it with: linuxcnc {folder / name}.ini")
