"""`wificnc linuxcnc`: the HAL component, and configurations with it."""

from __future__ import annotations

import ipaddress
import os
import re
import shlex
import shutil
from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.commands._output import OutputFolder
from wificnc.commands._secret import READ, Secret
from wificnc.commands._target import json_option
from wificnc.connection.wmc3.device import Device, find_devices
from wificnc.errors import UserError
from wificnc.files import paths
from wificnc.linuxcnc import halcompile
from wificnc.linuxcnc.config import KEY_FILE, files
from wificnc.linuxcnc.source import FILE_NAME, PROGRAM, build_command, component_source, is_component
from wificnc.output import STDOUT, why_not_writable, write_output, write_stdout
from wificnc.profile import load_machine

FIND_S = 2.0
ADDRESS = re.compile(r"^\[WIFICNC\](?:\n(?!\[).*)*?\nADDRESS\s*=\s*(\S+)", re.MULTILINE)


@click.group()
def command() -> None:
    """LinuxCNC on a controller: docs/linuxcnc.md."""


@command.command()
@click.option("--out", type=click.Path(path_type=Path),
              help=f"File, or the folder of it; default: {FILE_NAME}, here; - is stdout.")  # fmt: skip
@click.option("--install", is_flag=True, help="Build it with LinuxCNC's halcompile and install it for LinuxCNC.")
@click.option("--sudo", is_flag=True, help="With --install: as root, with sudo.")
@json_option
def component(out: Path | None, install: bool, sudo: bool, as_json: bool) -> None:
    """Write the HAL component as one C file for halcompile, or install it."""
    if sudo and not install:
        raise UserError("--sudo needs --install", hint="--install --sudo")
    source = component_source(paths.ROOT)
    if out == STDOUT:
        if install or as_json:
            option = "--install" if install else "--json"
            raise UserError(f"--out - is stdout, and {option} prints there, too", hint="one after the other")
        write_stdout(source.encode())
        return
    file = _write_source(out or Path(FILE_NAME), source) if out or not install else None
    if file and not install:
        ui.note(f"build it with: sudo {shlex.join(build_command('install', str(file)))}")
    program = halcompile.install(source, sudo=sudo) if install else None
    made = {"file": file and str(file), "program": program and str(program)}
    if as_json:
        ui.emit_json(made)
        return
    for path in filter(None, made.values()):
        ui.data.print(path, markup=False)


def _write_source(out: Path, source: str) -> Path:
    """Raises UserError: something else is there, or nothing can be written there."""
    file = out / FILE_NAME if out.is_dir() else out
    if why := why_not_writable(file):
        raise UserError(f"--out: cannot write {file}: {why}", hint="--out FILE, elsewhere")
    if file.exists() and not (file.is_file() and is_component(file.read_bytes())):
        raise UserError(f"{file} exists and is not the WiFiCNC component", hint="--out FILE, another one")
    write_output("--out", file, source.encode())
    return file


@command.command()
@click.argument("machine")
@click.option(
    "--to",
    "address",
    envvar="WIFICNC_WMC3",
    show_envvar=True,
    help="IPv4 address of the device; default: the one that is found.",
)
@click.option("--out", type=OutputFolder(), help="Folder; default: ~/linuxcnc/configs/MACHINE.")
@click.option(
    "--home/--no-home", "homes", default=None, help="The controller homes to switches; default: from the profile."
)
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@json_option
def init(machine: str, address: str | None, out: Path | None, homes: bool | None, force: bool, as_json: bool) -> None:
    """Write a configuration (INI, HAL, tool table) for MACHINE, the name or file of a machine profile."""
    name = re.sub(r"\W", "_", Path(machine).stem)
    folder = out or Path.home() / "linuxcnc" / "configs" / name
    profile = load_machine(machine)
    try:
        texts = files(name, _address(address), profile, homes)
    except ValueError as err:
        raise UserError(f"{machine}: {err}") from err
    there = [path for path in texts if (folder / path).exists()]
    if there and not force:
        raise UserError(f"{folder / there[0]} already exists", hint="--force overwrites it, --out writes elsewhere")
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        write_output("--out", folder / path, text.encode())
    if as_json:
        ui.emit_json({"configuration": f"{folder / name}.ini", "files": [str(folder / path) for path in texts]})
    else:
        ui.data.print(f"{folder / name}.ini")
    if not shutil.which(PROGRAM):
        ui.note(f"{PROGRAM} is not on this computer: `wificnc linuxcnc component --install` where LinuxCNC runs")
    ui.note(f"if the controller is locked: wificnc linuxcnc pair {folder}")
    ui.note(f"start it with: linuxcnc {folder / name}.ini")


@command.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False, exists=True))
@click.option("--key", type=Secret(), envvar="WIFICNC_KEY", show_envvar=True,
              help="The access key. Prompted for if not given. " + READ)  # fmt: skip
def pair(folder: Path, key: str | None) -> None:
    """Store the access key of the controller in the configuration in FOLDER, once the controller has accepted it.

    Only you can read the file. The key is shown at each USB connection of the controller, and by `wificnc wifi status`.
    """
    address = _address_in(folder)
    key = key or click.prompt("access key", hide_input=True, err=True)
    with Device(address, key) as device:
        device.prove_key()
    path = folder / KEY_FILE
    path.unlink(missing_ok=True)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
        file.write(f"{key}\n")
    ui.note(f"{address} has accepted the key; {path} is for LinuxCNC")


def _address_in(folder: Path) -> str:
    """The controller of a configuration. Raises UserError."""
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in sorted(folder.glob("*.ini"))]
    found = {str(match) for text in texts for match in ADDRESS.findall(text)}
    if len(found) != 1:
        said = f"addresses: {', '.join(sorted(found))}" if found else "no address of a controller"
        raise UserError(f"{folder}: {said} in its INI files", hint="`wificnc linuxcnc init` writes [WIFICNC] ADDRESS")
    return found.pop()


def _address(text: str | None) -> str:
    """An IPv4 address, or that of the one device in the network. Raises UserError."""
    if text is not None:
        try:
            return str(ipaddress.IPv4Address(text))
        except ValueError:
            raise UserError(f"--to {text!r} is not an IPv4 address", hint="like 192.168.1.50") from None
    ui.note("looking for the controller ...")
    found = sorted(address for address, _ in find_devices(FIND_S))
    if len(found) != 1:
        said = f"{len(found)} controllers answer: {', '.join(found)}" if found else "no controller answers"
        raise UserError(said, hint="choose one: --to ADDRESS")
    return found[0]
