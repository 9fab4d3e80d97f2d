"""The compilers of this machine that make Xtensa code."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

NEWEST, OLDEST = 30, 20  # LLVM releases that are looked for; before 20 the Xtensa back end has no windowed calls
LIBC_HEADERS = Path("/usr/include/newlib")  # Debian: libnewlib-dev; ESP-IDF's libc is newlib, too


@dataclass(frozen=True)
class Toolchain:
    """clang makes LLVM code, llc machine code: only llc lets the processor be chosen."""

    clang: str
    llc: str
    objdump: str
    version: int


class NoToolchainError(Exception):
    """Why nothing can be compiled here, and what to install."""


@cache
def find_toolchain() -> Toolchain:
    """The newest LLVM here with an Xtensa back end. Raises NoToolchainError."""
    for version in range(NEWEST, OLDEST - 1, -1):
        paths = [shutil.which(f"{tool}-{version}") for tool in ("clang", "llc", "llvm-objdump")]
        clang, llc, objdump = paths
        if clang and llc and objdump and _knows_xtensa(clang):
            if not (LIBC_HEADERS / "string.h").is_file():
                raise NoToolchainError(f"no C library headers in {LIBC_HEADERS} (apt-get install libnewlib-dev)")
            return Toolchain(clang, llc, objdump, version)
    raise NoToolchainError("no clang with an Xtensa back end (apt-get install clang-22 llvm-22)")


def _knows_xtensa(clang: str) -> bool:
    run = subprocess.run([clang, "-print-targets"], capture_output=True, text=True, check=False)
    return re.search(r"^\s*xtensa\b", run.stdout, re.MULTILINE) is not None
