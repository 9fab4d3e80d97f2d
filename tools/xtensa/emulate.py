"""C programs as Xtensa code in an emulator: gcc-xtensa-lx106 (call0 ABI) with picolibc, run by qemu-system-xtensa.

The lx106 has no floating point unit, and its compiler expects arithmetic in the chip's ROM: qemu/softfloat.c brings it.
So what equals this computer's result there does so in plain IEEE 754, with nothing contracted or reordered.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from wificnc.build.host import HEADERS

COMPILER, QEMU = "xtensa-lx106-elf-gcc", "qemu-system-xtensa"
SPECS = Path("/usr/lib/xtensa-lx106-elf/picolibc.specs")
PACKAGES = "gcc-xtensa-lx106 picolibc-xtensa-lx106-elf qemu-system-misc"
HERE = Path(__file__).parent / "qemu"

FLAGS = (
    f"--specs={SPECS}",
    "-std=gnu11",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-mlongcalls",
    "-mtext-section-literals",
    "-ffunction-sections",
    "-fdata-sections",
)
MACHINE = ("-M", "sim", "-cpu", "lx106", "-m", "64M", "-display", "none", "-serial", "none", "-monitor", "none")


def missing() -> str:
    """What to install; "" when all is here."""
    here = shutil.which(COMPILER) and shutil.which(QEMU) and SPECS.is_file()
    return "" if here else f"apt-get install {PACKAGES}"


def controller_sources(root: Path) -> list[Path]:
    """The core, and of the host's controller what needs no operating system."""
    pc = ["host", "host_hal", "host_store", "host_watch", "output_log", "tasks"]
    sim = ["hands", "trace", "virtual", "virtual_spindle"]
    host = [*(f"pc/{name}.c" for name in pc), *(f"sim/{name}.c" for name in sim)]
    return [*sorted((root / "core").rglob("*.c")), *(root / "targets" / name for name in host)]


def build(root: Path, sources: Sequence[Path], output: Path) -> Path:
    """Compile and link for the emulator. Raises RuntimeError with what the compiler said."""
    output.mkdir(parents=True, exist_ok=True)
    includes = [f"-I{root / folder}" for folder in HEADERS]
    files = [*sources, HERE / "start.S", HERE / "syscalls.c", HERE / "softfloat.c"]

    def compile_one(source: Path) -> str:
        made = output / f"{source.parent.name}_{source.name}.o"
        _run([COMPILER, *FLAGS, *includes, "-c", str(source), "-o", str(made)])
        return str(made)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compile_one, files))
    program = output / "program.elf"
    link = ["-nostartfiles", "-T", str(HERE / "link.ld"), "-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments"]
    _run([COMPILER, *FLAGS, *link, *objects, "-lm", "-o", str(program)])
    return program


def run(program: Path, stdin: bytes, seconds: float) -> str:
    """What it says. Raises RuntimeError when it ends with an error, TimeoutExpired when it does not end."""
    command = [QEMU, *MACHINE, "-semihosting", "-kernel", str(program)]
    done = subprocess.run(command, input=stdin, capture_output=True, timeout=seconds, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {(done.stdout + done.stderr).decode('utf-8', 'replace')}")
    return done.stdout.decode()


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
