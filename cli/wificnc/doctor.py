"""What of the things around WiFiCNC is here, and how to get what is not. Looks only; changes nothing."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from wificnc.build.checkout import copied_tree, find_checkout
from wificnc.build.compiler import identify_compiler, locate_compiler
from wificnc.build.esp32 import core_directory, find_platformio, missing_packages
from wificnc.build.mips import find_compiler
from wificnc.checked import paths
from wificnc.errors import BuildError
from wificnc.flash.ports import Port, usb_ports

OLDEST_PYTHON = (3, 10)
Verdict = Literal["good", "missing", "wrong"]  # missing: only some commands need it


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    name: str
    verdict: Verdict
    found: str
    fix: str = ""  # a command, or what to do
    needed_for: str = ""


def examine() -> list[Finding]:
    """All of it."""
    checks: Sequence[Callable[[], Iterator[Finding]]] = (
        python, sources, compiler, pic32mz_compiler, platformio, packages, serial_ports
    )  # fmt: skip
    return [finding for check in checks for finding in check()]


def python(version: tuple[int, ...] = tuple(sys.version_info[:3])) -> Iterator[Finding]:
    found = f"{platform.python_version()} ({sys.executable})"
    good = version[:2] >= OLDEST_PYTHON
    yield Finding("Python", "good" if good else "wrong", found, "" if good else "install Python 3.10 or newer")


def sources() -> Iterator[Finding]:
    try:
        yield Finding("sources", "good", str(find_checkout() or copied_tree(paths.CARRIED)))
    except BuildError as err:
        yield Finding("sources", "missing", "installed without them", err.hint or "", "build, sim, serve")


def compiler() -> Iterator[Finding]:
    try:
        yield Finding("C compiler", "good", identify_compiler(locate_compiler()).title)
    except BuildError as err:
        yield Finding("C compiler", "missing", err.message, err.hint or "", "build host, sim, serve")


def pic32mz_compiler() -> Iterator[Finding]:
    try:
        found = find_compiler()
        note = "; its image is larger than gcc's" if found.name == "zig" else ""
        yield Finding("PIC32MZ compiler", "good", identify_compiler(found.argv).title + note)
    except BuildError as err:
        yield Finding("PIC32MZ compiler", "missing", err.message, err.hint or "", "build of a PIC32MZ")


def platformio(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    try:
        found = find_platformio(environment)[0]
    except BuildError as err:
        yield Finding("PlatformIO", "missing", "not installed", err.hint or "", "build of an ESP32")
        return
    missing = missing_packages(core_directory(environment))
    if missing:
        what = f"{found}; not yet downloaded: {', '.join(missing)}"
        yield Finding(
            "PlatformIO", "missing", what, "the first `wificnc build` of a board downloads them", "build of an ESP32"
        )
    else:
        yield Finding("PlatformIO", "good", found)


def packages() -> Iterator[Finding]:
    for name, used_by in (
        ("esptool", "flash, wifi, nvs read"),
        ("esp-idf-nvs-partition-gen", "nvs build, wifi set"),
        ("hidapi", "flash of a PIC32MZ by its USB bootloader"),
    ):
        try:
            yield Finding(name, "good", importlib.metadata.version(name))
        except importlib.metadata.PackageNotFoundError:
            yield Finding(name, "missing", "not installed", f"pip install {name}", used_by)


def serial_ports(
    ports: Callable[[], list[Port]] = usb_ports, may_use: Callable[[str], bool] | None = None
) -> Iterator[Finding]:
    """Boards that are plugged in, and whether this user may talk to them."""
    found = ports()
    if not found:
        fix = "connect it with a data cable; on Linux `dmesg` shows whether the computer detected it"
        yield Finding("board", "missing", "no board is connected", fix, "flash, wifi, monitor")
    for port in found:
        if (may_use or _may_use)(port.device):
            yield Finding("board", "good", f"{port.device}  {port.title}")
        else:
            yield Finding("board", "wrong", f"{port.device}: no permission to use it", _right_to_ports())


def _may_use(device: str) -> bool:
    return sys.platform == "win32" or os.access(device, os.R_OK | os.W_OK)


def _right_to_ports() -> str:
    """The group that owns serial ports here."""
    group = "uucp" if Path("/etc/arch-release").exists() else "dialout"
    tool = "usermod" if shutil.which("usermod") else "adduser"
    return f"sudo {tool} -aG {group} $USER, then log in again"
