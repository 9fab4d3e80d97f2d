"""Compilers that build the PIC32MZ's firmware: Debian's cross gcc, and PyPI's zig, whose clang knows MIPS.

Both are made for other things, and nothing of those is used: targets/pic32mz brings its own C library, start-up code,
interrupt wrappers and linker script. gcc's image is the smaller one, and what all tests run.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from wificnc.errors import BuildError

Choice = Literal["gcc", "zig"]

COMPILER = "mipsel-linux-gnu-gcc"
NO_COMPILER_HINT = "Debian, Ubuntu: apt-get install gcc-mipsel-linux-gnu; anywhere: pip install ziglang"

# -ffp-contract=off: the same bits as the host.
LANGUAGE = (
    *("-std=c11", "-Os", "-g", "-ffreestanding", "-fno-pic", "-G0"),
    *("-fno-math-errno", "-ffp-contract=off"),
    "-DWITH_ENCODER=0",  # core/config.h; no board with this chip has one
    "-DWITH_HOST=0",  # nor a network
    *("-fno-asynchronous-unwind-tables", "-fno-stack-protector"),
    *("-ffunction-sections", "-fdata-sections"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wshadow"),
)
LINK = ("-nostdlib", "-static", "-Wl,--gc-sections,--build-id=none")


@dataclass(frozen=True)
class MipsCompiler:
    """How a compiler is called, and what makes it build for this processor and nothing around it."""

    name: Choice
    argv: tuple[str, ...]
    flags: tuple[str, ...]
    fast: tuple[str, ...]  # of what interrupts are made of
    quick: tuple[str, ...]  # of what runs for each piece of a path
    library: tuple[str, ...]  # of the C library
    link: tuple[str, ...]

    @property
    def family(self) -> str:
        """As compiler.Compiler has it."""
        return "gcc" if self.name == "gcc" else "clang"

    def own_headers(self) -> list[str]:
        """The compiler's own headers, and none of an operating system."""
        if self.name == "zig":
            return []  # it has no others for a computer without one
        run = subprocess.run(
            [*self.argv, "-print-file-name=include"],
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            check=True,
        )
        return ["-nostdinc", "-isystem", run.stdout.strip()]


# -Os over all files together (LTO) fits the flash budget. Motion, from a block to its spans, is for speed: a quarter
# fewer instructions. So is what interrupts are made of, and each of its functions stays the one that tools/mips looks
# at; calls into the C library arise when all is optimised already. Scheduled early, the step interrupt runs out of free
# registers.
_GCC_MACHINE = ("-march=mips32r2", "-mhard-float", "-mfp64", "-EL", "-mno-abicalls", "-fno-pie")

# nomadd4: clang would multiply and add by one instruction, which this chip does not have.
_ZIG_MACHINE = ("-target", "mipsel-freestanding-eabihf", "-mcpu=mips32r2+fp64+noabicalls+nomadd4")


def _gcc(path: str) -> MipsCompiler:
    return MipsCompiler(
        "gcc",
        (path,),
        (*_GCC_MACHINE, *LANGUAGE, "-flto", "-Werror"),
        ("-O2", "-fno-schedule-insns", "-fno-lto"),
        ("-O2",),
        ("-fno-lto",),
        (*_GCC_MACHINE, *LANGUAGE, *LINK, "-flto=auto", "-no-pie", "-Wl,--fatal-warnings,-n,-z,noexecstack"),
    )


def _zig() -> MipsCompiler:
    return MipsCompiler(
        "zig",
        (sys.executable, "-m", "ziglang", "cc"),
        (*_ZIG_MACHINE, *LANGUAGE, "-fomit-frame-pointer", "-fno-jump-tables", "-fno-sanitize=all"),
        ("-O2",),
        ("-O2",),
        (),
        (*_ZIG_MACHINE, "-g", *LINK, "-Wl,-e,_reset,-z,norelro"),
    )


def find_compiler(
    wanted: Choice | None = None,
    which: Callable[[str], str | None] = shutil.which,
    has_zig: Callable[[], bool] = lambda: importlib.util.find_spec("ziglang") is not None,
) -> MipsCompiler:
    """The one that was asked for, or gcc, or zig. Raises BuildError."""
    path = which(COMPILER)
    if path is not None and wanted != "zig":
        return _gcc(path)
    if wanted != "gcc" and has_zig():
        return _zig()
    missing = {"gcc": COMPILER, "zig": "ziglang", None: f"{COMPILER} and no ziglang"}[wanted]
    raise BuildError(f"there is no {missing} on this machine", hint=NO_COMPILER_HINT)


def include_flags(compiler: MipsCompiler, root: Path, folders: list[Path]) -> list[str]:
    """Our C library's headers and these folders."""
    library = ["-isystem", str(root / "targets/pic32mz/libc")]
    return [*compiler.own_headers(), *library, *(f"-I{path}" for path in folders)]
