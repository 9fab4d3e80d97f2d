"""The systems and computers that the PC target is made for, and how `zig cc` is asked for each."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

# Sources that one kind of system compiles end like this; all others compile everywhere.
ENDINGS = ("_posix", "_windows")


@dataclass(frozen=True)
class System:
    """What differs between operating systems in compiling and linking."""

    macros: tuple[str, ...]  # which part of the system's headers we use
    code_flags: tuple[str, ...]
    link_flags: tuple[str, ...]  # of the shared library
    libraries: tuple[str, ...]
    library: str  # name of the shared library's file
    program_suffix: str
    ending: str  # one of ENDINGS

    @property
    def flags(self) -> tuple[str, ...]:
        """Of the compiler."""
        return (*self.macros, *self.code_flags)


SYSTEMS = {
    "linux": System(
        macros=("-D_POSIX_C_SOURCE=200809L", "-D_DEFAULT_SOURCE"),
        # inside the library a function is what it says, so it may be inlined
        code_flags=("-fPIC", "-fno-semantic-interposition"),
        link_flags=("-Wl,-Bsymbolic",),  # and calls from file to file take no detour over a table
        libraries=("-lm",),
        library="libwificnc.so",
        program_suffix="",
        ending="_posix",
    ),
    "macos": System(
        macros=("-D_DARWIN_C_SOURCE",),
        code_flags=("-fPIC",),
        link_flags=("-Wl,-install_name,@rpath/libwificnc.dylib",),
        libraries=("-lm",),
        library="libwificnc.dylib",
        program_suffix="",
        ending="_posix",
    ),
    "windows": System(
        macros=("-DWIN32_LEAN_AND_MEAN",),
        code_flags=(),
        link_flags=(),
        libraries=("-lws2_32", "-lwinmm", "-lbcrypt", "-lshell32"),
        library="wificnc.dll",
        program_suffix=".exe",
        ending="_windows",
    ),
}


@dataclass(frozen=True)
class Platform:
    """A kind of computer that a release is made for."""

    name: str
    system: System
    zig_target: str  # with the oldest system that it runs on
    wheel_tag: str
    emulator: str | None = None  # runs its programs on a Linux
    emulated_target: str | None = None  # ... if they are made for this target, which needs no library of that computer

    @property
    def target_flags(self) -> tuple[str, ...]:
        """Of zig cc, to compile and to link."""
        return ("-target", self.zig_target)

    def emulated(self) -> Platform:
        """The same computer, for programs that its emulator runs."""
        if self.emulated_target is None:
            return self
        return replace(self, name=f"{self.name}-emulated", zig_target=self.emulated_target)


PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("linux-x86_64", SYSTEMS["linux"], "x86_64-linux-gnu.2.17", "manylinux2014_x86_64"),
        Platform(
            "linux-aarch64",
            SYSTEMS["linux"],
            "aarch64-linux-gnu.2.17",
            "manylinux2014_aarch64",
            emulator="qemu-aarch64",
            emulated_target="aarch64-linux-musl",
        ),
        Platform(
            "linux-armv7",
            SYSTEMS["linux"],
            "arm-linux-gnueabihf.2.31",
            "manylinux_2_31_armv7l",
            emulator="qemu-arm",
            emulated_target="arm-linux-musleabihf",
        ),
        Platform("macos-arm64", SYSTEMS["macos"], "aarch64-macos.13.0", "macosx_13_0_arm64"),
        Platform("macos-x86_64", SYSTEMS["macos"], "x86_64-macos.13.0", "macosx_13_0_x86_64"),
        Platform("windows-x86_64", SYSTEMS["windows"], "x86_64-windows-gnu", "win_amd64", emulator="wine"),
        Platform("windows-arm64", SYSTEMS["windows"], "aarch64-windows-gnu", "win_arm64"),
    )
}


def this_system() -> System:
    """The one that runs this program; any unknown one is taken for a Linux."""
    return SYSTEMS[{"darwin": "macos", "win32": "windows"}.get(sys.platform, "linux")]


def sources_of(system: System, sources: Iterable[Path]) -> list[Path]:
    """Those that this system compiles."""
    others = tuple(ending for ending in ENDINGS if ending != system.ending)
    return [path for path in sources if not path.stem.endswith(others)]
