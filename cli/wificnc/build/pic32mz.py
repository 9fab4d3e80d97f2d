"""The firmware of a PIC32MZ board: core and targets/pic32mz to ELF and Intel HEX, without a vendor's tools.

The compiler is Debian's cross gcc for little-endian MIPS. It is built for Linux, and nothing of Linux is used:
targets/pic32mz brings its own C library, start-up code and linker script.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import compiler_stamp, identify_compiler
from wificnc.build.lock import build_lock
from wificnc.build.objects import Unit, compile_stale, failure, is_older
from wificnc.chip.image import elf_symbols, read_elf, write_hex
from wificnc.errors import BuildError

COMPILER = "mipsel-linux-gnu-gcc"
NO_COMPILER_HINT = "Debian, Ubuntu: apt-get install gcc-mipsel-linux-gnu"

FOLDERS = ("core", "targets/pic32mz")  # sources, and where headers are looked for
LINKER_SCRIPT = Path("targets/pic32mz/chip/pic32mz.ld")

# The processor, and none of what a compiler for Linux takes for granted (docs/pic32mz.md). -ffp-contract=off: the same
# bits as the host.
MACHINE = (
    *("-march=mips32r2", "-mhard-float", "-mfp64", "-EL"),
    *("-mno-abicalls", "-fno-pic", "-fno-pie", "-G0"),
    "-ffreestanding",
)
FLAGS = (
    *MACHINE,
    *("-std=c11", "-Os", "-flto", "-g"),
    *("-fno-math-errno", "-ffp-contract=off"),
    "-DWITH_ENCODER=0",  # core/config.h; no board with this chip has one
    "-DWITH_HOST=0",  # nor a network
    *("-fno-asynchronous-unwind-tables", "-fno-stack-protector"),
    *("-ffunction-sections", "-fdata-sections"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"),
)
PREFIX_MAP = "-ffile-prefix-map={root}=."  # debug information is the same wherever the repository lies
# -Os over all files at once fits the flash budget. What interrupts are made of is for speed, and each of its functions
# stays the one that tools/mips looks at; calls into the C library arise when all is optimised already.
FAST = ("core/step/isr", "core/step/position", "targets/pic32mz/hal/", "targets/pic32mz/chip/")
LIBRARY = "targets/pic32mz/libc/"
LINK = (
    "-flto=auto",
    "-nostdlib",
    "-static",
    "-no-pie",
    "-Wl,--gc-sections,--build-id=none,--fatal-warnings",
    "-Wl,-n,-z,noexecstack",
)

# What the chip has for us (targets/pic32mz/chip/pic32mz.ld), and what we allow ourselves of it.
FLASH_BYTES, FLASH_BUDGET = 1024 * 1024, 128 * 1024
RAM_BYTES, RAM_BUDGET = 512 * 1024, 64 * 1024


@dataclass(frozen=True)
class Pic32Build:
    """What a build did."""

    elf: Path
    hex: Path
    compiler: str
    sources: int
    compiled: int
    seconds: float
    flash_bytes: int  # program flash taken
    ram_bytes: int  # of data and stack


def find_compiler() -> str:
    """The compiler's path. Raises BuildError."""
    path = shutil.which(COMPILER)
    if path is None:
        raise BuildError(f"there is no {COMPILER} on this machine", hint=NO_COMPILER_HINT)
    return path


def build_pic32mz(board: Board, *, clean: bool = False, root: Path | None = None) -> Pic32Build:
    """Bring ELF and HEX of a board up to date. @param clean  forget what was built before. Raises BuildError."""
    begin = time.perf_counter()
    root = root or checkout_root()
    compiler = find_compiler()
    directory = root / "build" / board.id
    elf, hex_file = directory / "wificnc.elf", directory / "wificnc.hex"
    with build_lock(directory):
        if clean:
            shutil.rmtree(directory / "obj", ignore_errors=True)
        title = _compiler_title(directory, compiler)
        write_if_changed(directory / "pin_config.h", pin_header_text(board))
        units = [_unit(root, directory, source) for source in firmware_sources(root)]
        compiled, _ = compile_stale(_compile_command(root, compiler, directory), units, title, root)
        objects = [unit.object for unit in units]
        if compiled or is_older(elf, [*objects, root / LINKER_SCRIPT]) or is_older(hex_file, [elf]):
            _link(root, compiler, objects, elf, title)
            blocks = read_elf(elf.read_bytes())
            hex_file.write_text(write_hex(blocks))
    flash, ram = _sizes(elf)
    return Pic32Build(elf, hex_file, title, len(units), compiled, time.perf_counter() - begin, flash, ram)


def firmware_sources(root: Path) -> list[Path]:
    """Every C and assembly file of the firmware."""
    folders = [root / folder for folder in FOLDERS]
    return sorted(path for folder in folders for pattern in ("*.c", "*.S") for path in folder.rglob(pattern))


def own_headers(root: Path, compiler: str) -> list[str]:
    """The compiler's own headers and our C library, and no others."""
    run = subprocess.run([compiler, "-print-file-name=include"], capture_output=True, text=True, check=True)
    return ["-nostdinc", "-isystem", run.stdout.strip(), "-isystem", str(root / "targets/pic32mz/libc")]


def _compile_command(root: Path, compiler: str, directory: Path) -> list[str]:
    includes = [f"-I{path}" for path in (directory, *(root / folder for folder in FOLDERS))]
    here = PREFIX_MAP.format(root=root)
    return [compiler, *FLAGS, here, *own_headers(root, compiler), *includes]


def _unit(root: Path, directory: Path, source: Path) -> Unit:
    name = source.relative_to(root)
    flags: tuple[str, ...] = ()
    if name.as_posix().startswith(FAST):
        flags = ("-O2", "-fno-schedule-insns", "-fno-lto")  # scheduled early, it runs out of free registers
    elif name.as_posix().startswith(LIBRARY):
        flags = ("-fno-lto",)
    return Unit(source, directory / "obj" / name.with_suffix(".o"), flags)


def _compiler_title(directory: Path, compiler: str) -> str:
    """Who it is; another compiler or other flags make every object stale."""
    stamp_file = directory / "compiler.json"
    stamp = json.dumps([compiler_stamp((compiler,)), FLAGS, FAST, LIBRARY, PREFIX_MAP, LINK])
    stored = json.loads(stamp_file.read_text()) if stamp_file.is_file() else {}
    if stored.get("stamp") == stamp:
        return str(stored["title"])
    title = identify_compiler((compiler,)).title
    shutil.rmtree(directory / "obj", ignore_errors=True)
    stamp_file.write_text(json.dumps({"stamp": stamp, "title": title}))
    return title


def _link(root: Path, compiler: str, objects: Sequence[Path], elf: Path, title: str) -> None:
    options = [PREFIX_MAP.format(root=root), f"-Wl,-T,{root / LINKER_SCRIPT}", f"-Wl,-Map,{elf.with_suffix('.map')}"]
    command = [compiler, *MACHINE, *LINK, *options, "-o", str(elf), *map(str, objects)]
    run = subprocess.run(command, cwd=root, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if run.returncode != 0:
        elf.unlink(missing_ok=True)
        raise failure(f"{elf.name} did not link ({title})", run.stderr)


def _sizes(elf: Path) -> tuple[int, int]:
    """Program flash and RAM taken, from the linker script's symbols."""
    data = elf.read_bytes()
    symbols = elf_symbols(data)
    initial = symbols["_data_end"] - symbols["_data_start"]
    flash = symbols["_image_end"] - symbols["_exception_base"] + initial
    return flash, symbols["_stack_top"] - symbols["_data_start"]
