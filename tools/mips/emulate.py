"""C programs as MIPS code in an emulator: Debian's cross compiler and C library, run by qemu-mipsel.

The instructions are those of the firmware (MIPS32r2 with floating point), the operating system is this computer's.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from wificnc.build.compiler import compiler_stamp
from wificnc.build.host import HEADERS
from wificnc.build.lock import build_lock
from wificnc.build.mips import COMPILER
from wificnc.build.objects import Unit, compile_stale

QEMU = "qemu-mipsel"
HEADER = Path("/usr/mipsel-linux-gnu/include/stdio.h")
PACKAGES = "gcc-mipsel-linux-gnu libc6-dev-mipsel-cross qemu-user"
PROCESSOR = "74Kf"  # MIPS32r2 with an FPU and Debian's kind of NaN
FLAGS = ("-std=gnu11", "-O1", "-march=mips32r2", "-static", "-ffp-contract=off", "-fno-math-errno")


def missing() -> str:
    """What to install; "" when all is here."""
    here = shutil.which(COMPILER) and shutil.which(QEMU) and HEADER.is_file()
    return "" if here else f"apt-get install {PACKAGES}"


def controller_sources(root: Path) -> list[Path]:
    """The core, and of the PC's controller what needs no operating system."""
    pc = [
        "hands",
        "host",
        "host_bus",
        "host_drivers",
        "host_figures",
        "host_hal",
        "host_store",
        "host_watch",
        "output_log",
    ]
    pc += ["port_file_posix", "tasks", "trace", "virtual", "virtual_spindle", "virtual_tmc", "virtual_vfd"]
    return [*sorted((root / "core").rglob("*.c")), *(root / "targets" / "pc" / f"{name}.c" for name in pc)]


def compile_files(root: Path, sources: Sequence[Path], output: Path, flags: Sequence[str] = FLAGS) -> list[Path]:
    """Objects for the emulator; those that are fresh stay. Raises BuildError with what the compiler said."""
    argv = (COMPILER,)
    command = [*argv, *flags, *(f"-I{root / folder}" for folder in HEADERS)]
    stamp = hashlib.sha256(json.dumps([compiler_stamp(argv), command]).encode()).hexdigest()[:16]
    folder = output / stamp
    units = [Unit(source, folder / f"{source.parent.name}_{source.stem}.o") for source in sources]
    with build_lock(folder):
        compile_stale(command, units, COMPILER)
    return [unit.object for unit in units]


def link(objects: Sequence[Path], program: Path) -> Path:
    """A program for run(). Raises RuntimeError with what the linker said."""
    _run([COMPILER, *FLAGS, *map(str, objects), "-lm", "-o", str(program)])
    return program


def run(program: Path, stdin: bytes, seconds: float) -> str:
    """What it says. Raises RuntimeError when it ends with an error, TimeoutExpired when it does not end."""
    command = [QEMU, "-cpu", PROCESSOR, str(program)]
    done = subprocess.run(command, input=stdin, capture_output=True, timeout=seconds, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {(done.stdout + done.stderr).decode('utf-8', 'replace')}")
    return done.stdout.decode()


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
