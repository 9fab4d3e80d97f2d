"""Finding a C compiler, and saying what it is."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wificnc.errors import BuildError

CANDIDATES = ("cc", "gcc", "clang")

# The newest release of each compiler that this tree is known to compile on without a warning. A newer one may know
# warnings that we have never seen: there they are shown, and do not stop a user's build.
NEWEST_CLEAN = {"gcc": 15, "clang": 22}

NO_COMPILER_HINT = "install one (Debian: apt-get install gcc), or `pip install ziglang`, which brings its own"


@dataclass(frozen=True)
class Compiler:
    """A C compiler: how it is called, and which one it is."""

    argv: tuple[str, ...]
    family: str  # gcc, clang or unknown; zig is clang
    version: str

    @property
    def is_known_clean(self) -> bool:
        """Whether a warning of this compiler is a fault of ours and so an error."""
        major = re.match(r"\d+", self.version)
        return major is not None and int(major[0]) <= NEWEST_CLEAN.get(self.family, 0)

    @property
    def title(self) -> str:
        zig = "zig cc, " if "ziglang" in self.argv else ""
        return f"{zig}{self.family} {self.version}"


def locate_compiler(environment: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """How to call the compiler: $CC, cc, gcc, clang, or PyPI's zig. Raises BuildError when there is none."""
    if wanted := environment.get("CC", "").strip():
        argv = shlex.split(wanted, posix=os.name == "posix")  # else a backslash is part of a path
        if shutil.which(argv[0], path=environment.get("PATH")) is None:
            raise BuildError(f"compiler not found: {argv[0]!r} (from the variable CC)", hint="unset CC, or correct it")
        return tuple(argv)
    for name in CANDIDATES:
        if path := shutil.which(name, path=environment.get("PATH")):
            return (path,)
    if importlib.util.find_spec("ziglang") is not None:
        return (sys.executable, "-m", "ziglang", "cc")
    raise BuildError("no C compiler found on this computer", hint=NO_COMPILER_HINT)


def compiler_stamp(argv: tuple[str, ...]) -> list[object]:
    """What changes when the compiler behind a name changes, without running it."""
    if "ziglang" in argv:
        spec = importlib.util.find_spec("ziglang")
        file = Path(spec.origin) if spec and spec.origin else Path(sys.executable)
    else:
        file = Path(shutil.which(argv[0]) or argv[0]).resolve()
    status = file.stat()
    return [list(argv), str(file), status.st_size, status.st_mtime_ns]


def identify_compiler(argv: tuple[str, ...]) -> Compiler:
    """Ask the compiler who it is."""
    run = subprocess.run(
        [*argv, "--version"],
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        stdin=subprocess.DEVNULL,
    )
    if run.returncode != 0:
        raise BuildError(f"{shlex.join(argv)} --version failed:\n{run.stderr.strip()}", hint=NO_COMPILER_HINT)
    return parse_version(argv, run.stdout)


def parse_version(argv: tuple[str, ...], text: str) -> Compiler:
    """Family and version from what `--version` printed."""
    if match := re.search(r"clang version (\d+(?:\.\d+)*)", text):
        return Compiler(argv, "clang", match[1])
    if match := re.search(r"^\S*(?:gcc|cc)\S* .*?(\d+\.\d+(?:\.\d+)?)", text):
        return Compiler(argv, "gcc", match[1])
    return Compiler(argv, "unknown", (text.splitlines() or ["?"])[0].strip())
