"""What of the things around WiFiCNC is here, and how to get what is not. Looks only; changes nothing."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from wificnc.build.checkout import copied_tree, find_checkout
from wificnc.build.compiler import identify_compiler, locate_compiler
from wificnc.build.esp32 import core_directory, find_platformio, missing_packages
from wificnc.build.mips import find_compiler
from wificnc.build.native import carried_library
from wificnc.errors import BuildError
from wificnc.files import paths
from wificnc.firmware.flash.ports import Port, usb_ports
from wificnc.system import System

OLDEST_PYTHON = (3, 10)
Verdict = Literal["good", "missing", "wrong"]  # missing: only some commands need it
PACKAGES = (
    ("esptool", "flash, wifi, nvs read"),
    ("esp-idf-nvs-partition-gen", "nvs build, wifi set"),
    ("hidapi", "flash of a PIC32MZ by its USB bootloader"),
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    name: str
    verdict: Verdict
    found: str
    fix: str = ""  # the command that installs it or permits it; what to do, where no command does
    needed_for: str = ""


def _host_compiler() -> str:
    return identify_compiler(locate_compiler()).title


def _pic32mz_compiler() -> str:
    found = find_compiler()
    return identify_compiler(found.argv).title + ("; its image is larger than gcc's" if found.name == "zig" else "")


def _may_use(device: str) -> bool:
    return sys.platform == "win32" or os.access(device, os.R_OK | os.W_OK)


@dataclass(frozen=True)
class Look:
    """How each thing is looked for; tests look at computers that do not exist. What raises, raises BuildError."""

    python: tuple[int, ...] = tuple(sys.version_info[:3])
    checkout: Callable[[], Path | None] = find_checkout
    library: Callable[[], Path | None] = carried_library  # the controller of this computer, in an installed package
    compiler: Callable[[], str] = _host_compiler
    pic32mz_compiler: Callable[[], str] = _pic32mz_compiler
    platformio: Callable[[], str] = lambda: find_platformio()[0]
    downloads: Callable[[], Sequence[str]] = lambda: missing_packages(core_directory())
    version: Callable[[str], str] = importlib.metadata.version
    ports: Callable[[], list[Port]] = usb_ports
    may_use: Callable[[str], bool] = _may_use


@dataclass(frozen=True)
class Doctor:
    """All that is looked at on one computer."""

    system: System = field(default_factory=System)
    look: Look = field(default_factory=Look)

    def examine(self) -> list[Finding]:
        checks = (self.python, self.sources, self.compiler, self.pic32mz_compiler, self.platformio, self.packages)
        return [finding for check in (*checks, self.node, self.serial_ports) for finding in check()]

    def python(self) -> Iterator[Finding]:
        found = f"{platform.python_version()} ({self.system.executable})"
        if self.look.python[:2] >= OLDEST_PYTHON:
            yield Finding("Python", "good", found)
        else:
            fix = self.system.install("python") or "install Python 3.10 or newer"
            yield Finding("Python", "wrong", found, fix, "everything")

    def sources(self) -> Iterator[Finding]:
        try:
            yield Finding("sources", "good", str(self.look.checkout() or copied_tree(paths.CARRIED)))
        except BuildError as err:
            yield Finding("sources", "missing", "installed without them", err.hint or "", "build")

    def compiler(self) -> Iterator[Finding]:
        library = self.look.library() if self.look.checkout() is None else None
        if library is not None:
            yield Finding("C compiler", "good", f"not needed: the package has {library.name}")
            return
        fix = "xcode-select --install" if self.system.platform == "darwin" else self.system.install("cc")
        yield self._built_with("C compiler", self.look.compiler, fix or self.system.pip("ziglang"), "sim, check, serve")

    def pic32mz_compiler(self) -> Iterator[Finding]:
        fix = self.system.install("mips") or self.system.pip("ziglang")
        yield self._built_with("PIC32MZ compiler", self.look.pic32mz_compiler, fix, "build of a PIC32MZ")

    def platformio(self) -> Iterator[Finding]:
        fix, used_by = self.system.pip("platformio"), "build of an ESP32"
        found = self._built_with("PlatformIO", self.look.platformio, fix, used_by)
        if found.verdict == "good" and (missing := self.look.downloads()):
            what = f"{found.found}; not yet downloaded: {', '.join(missing)}"
            yield Finding(found.name, "missing", what, "the first `wificnc build` of a board downloads them", used_by)
        else:
            yield found

    def packages(self) -> Iterator[Finding]:
        for name, used_by in PACKAGES:
            try:
                yield Finding(name, "good", self.look.version(name))
            except importlib.metadata.PackageNotFoundError:
                yield Finding(name, "missing", "not installed", self.system.pip(name), used_by)

    def node(self) -> Iterator[Finding]:
        """A package carries the page."""
        if self.look.checkout() is None:
            return
        if found := self.system.which("node"):
            yield Finding("Node.js", "good", found)
        else:
            fix = self.system.install("node") or "install Node.js 20 or newer: https://nodejs.org"
            yield Finding("Node.js", "missing", "not installed", fix, "make web, which builds the page")

    def serial_ports(self) -> Iterator[Finding]:
        """Boards that are plugged in, and whether this user may talk to them."""
        found = self.look.ports()
        if not found:
            yield Finding("board", "missing", "no board is connected", self._plug_in(), "flash, wifi, monitor")
        for port in found:
            if self.look.may_use(port.device):
                yield Finding("board", "good", f"{port.device}  {port.title}")
            elif self.system.platform == "linux":
                fix = f"{self.system.join_serial_group()}, then log in again"
                yield Finding("board", "wrong", f"{port.device}: no permission to use it", fix)
            else:
                yield Finding("board", "wrong", f"{port.device}: cannot be used", "close the program that has it open")

    def _plug_in(self) -> str:
        shows = {"win32": "Device Manager lists it", "darwin": "`ls /dev/cu.*` lists it"}
        seen = shows.get(self.system.platform, "`dmesg` shows whether the computer detected it")
        return f"connect it with a data cable; {seen}; drivers: docs/start/README.md"

    def _built_with(self, name: str, look: Callable[[], str], fix: str, used_by: str) -> Finding:
        try:
            return Finding(name, "good", look())
        except BuildError as err:
            return Finding(name, "missing", err.message, fix, used_by)
