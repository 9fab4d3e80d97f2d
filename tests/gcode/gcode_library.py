"""core/gcode and its neighbours alone, as a small shared library.

WIFICNC_TEST_CFLAGS adds compiler flags, for example -fsanitize=address,undefined (with libasan in LD_PRELOAD).
"""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess

from c_library import load
from gcode_core import ROOT
from layouts import HOST
from wificnc.build.compiler import locate_compiler

FLAGS = ["-std=c11", "-O2", "-g", "-fPIC", "-shared", "-ffp-contract=off", "-Icore", "-Itargets/sim"]
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
SOURCES = (
    "core/input/line_reader.c",
    *(
        f"targets/sim/{name}.c"
        for name in ("knowledge", "oword", "program", "program_end", "program_text", "status_text")
    ),
    "core/base/pow.c",
    "core/base/trig.c",
    "tests/gcode/compute.c",
)


def gcode_library() -> ctypes.CDLL:
    """Compiled again in each session: it takes a second, and is never stale."""
    folder = ROOT / "build" / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"gcode-{os.getpid()}.so"
    flags = [*FLAGS, *WARNINGS, *shlex.split(os.environ.get("WIFICNC_TEST_CFLAGS", ""))]
    sources = [*map(str, sorted((ROOT / "core/gcode").glob("*.c"))), *SOURCES]
    subprocess.run([*locate_compiler(), *flags, *sources, "-o", str(built), "-lm"], cwd=ROOT, check=True)
    lib = load(built.replace(folder / "gcode.so"), HOST)
    lib.gcode_plain_line.restype = lib.number_read.restype = ctypes.c_void_p  # a place in the text, not a text
    return lib
