"""The firmware of a PIC32MZ board: FOLDERS to ELF and Intel HEX, without a vendor's tools.

The compilers are those of build/mips.py.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import compiler_stamp, identify_compiler
from wificnc.build.frames import LARGER, firmware_limit, frame_flags, frame_limit
from wificnc.build.image import elf_symbols, read_elf, write_hex
from wificnc.build.lock import build_lock
from wificnc.build.mips import Choice, MipsCompiler, find_compiler, include_flags
from wificnc.build.objects import Unit, compile_stale, failure, is_older
from wificnc.files.jsonfile import read_json

FOLDERS = ("core", "targets/chip", "targets/pic32mz")  # sources, and where headers are looked for
LINKER_SCRIPT = Path("targets/pic32mz/chip/pic32mz.ld")
PREFIX_MAP = "-ffile-prefix-map={root}=."  # debug information is the same wherever the repository lies
FAST = ("core/step/isr", "core/step/position", "targets/chip/", "targets/pic32mz/hal/", "targets/pic32mz/chip/")
QUICK = ("core/motion/", "core/segment/", "core/step/")
LIBRARY = "targets/pic32mz/libc/"

# What the chip has for us (targets/pic32mz/chip/pic32mz.ld), and what we allow ourselves of it.
FLASH_BYTES, FLASH_BUDGET = 1024 * 1024, 512 * 1024
RAM_BYTES, RAM_BUDGET = 512 * 1024, 256 * 1024


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


def build_pic32mz(
    board: Board,
    *,
    clean: bool = False,
    root: Path | None = None,
    cc: Choice | None = None,
    output: Path | None = None,
) -> Pic32Build:
    """Bring ELF and HEX of a board up to date. @param clean  forget what was built before. cc  None: gcc, or zig where
    there is none. output  the folder, else build/BOARD. Raises BuildError."""
    begin = time.perf_counter()
    root = root or checkout_root()
    compiler = find_compiler(cc)
    directory = output or root / "build" / board.id
    elf, hex_file = directory / "wificnc.elf", directory / "wificnc.hex"
    with build_lock(directory):
        if clean:
            shutil.rmtree(directory / "obj", ignore_errors=True)
        title = _compiler_title(directory, compiler)
        write_if_changed(directory / "pin_config.h", pin_header_text(board))
        units = [_unit(root, directory, compiler, source) for source in firmware_sources(root)]
        compiled, _ = compile_stale(_compile_command(root, compiler, directory), units, title, root)
        objects = [unit.object for unit in units]
        if compiled or is_older(elf, [*objects, root / LINKER_SCRIPT]):
            _link(root, compiler, objects, elf, title)
        if is_older(hex_file, [elf]):
            blocks = read_elf(elf.read_bytes())
            hex_file.write_text(write_hex(blocks), encoding="utf-8")
    flash, ram = _sizes(elf)
    return Pic32Build(elf, hex_file, title, len(units), compiled, time.perf_counter() - begin, flash, ram)


def firmware_sources(root: Path) -> list[Path]:
    """Every C and assembly file of the firmware."""
    folders = [root / folder for folder in FOLDERS]
    return sorted(path for folder in folders for pattern in ("*.c", "*.S") for path in folder.rglob(pattern))


def _compile_command(root: Path, compiler: MipsCompiler, directory: Path) -> list[str]:
    includes = include_flags(compiler, root, [directory, *(root / folder for folder in FOLDERS)])
    return [*compiler.argv, *compiler.flags, PREFIX_MAP.format(root=root), *includes]


def _unit(root: Path, directory: Path, compiler: MipsCompiler, source: Path) -> Unit:
    name = source.relative_to(root)
    flags = frame_flags(frame_limit(source, root), family=compiler.family)
    if name.as_posix().startswith(FAST):
        flags += compiler.fast
    elif name.as_posix().startswith(QUICK):
        flags += compiler.quick
    elif name.as_posix().startswith(LIBRARY):
        flags += compiler.library
    return Unit(source, directory / "obj" / name.with_suffix(".o"), flags)


def _compiler_title(directory: Path, compiler: MipsCompiler) -> str:
    """Who it is; another compiler or other flags make every object stale."""
    stamp_file = directory / "compiler.json"
    flags = [compiler.flags, compiler.fast, compiler.quick, compiler.library, compiler.link]
    stamp = json.dumps([compiler_stamp(compiler.argv), flags, LARGER, FAST, QUICK, LIBRARY, PREFIX_MAP])
    with suppress(OSError, ValueError, TypeError, KeyError):  # missing or damaged
        stored = read_json(stamp_file)
        if stored["stamp"] == stamp:
            return str(stored["title"])
    title = identify_compiler(compiler.argv).title
    shutil.rmtree(directory / "obj", ignore_errors=True)
    stamp_file.write_text(json.dumps({"stamp": stamp, "title": title}), encoding="utf-8")
    return title


def _link(root: Path, compiler: MipsCompiler, objects: Sequence[Path], elf: Path, title: str) -> None:
    options = [PREFIX_MAP.format(root=root), f"-Wl,-T,{root / LINKER_SCRIPT}"]
    if compiler.name == "gcc":  # zig writes no map, and makes no code here
        options.append(f"-Wl,-Map,{elf.with_suffix('.map')}")
        options += frame_flags(firmware_limit("pic32mz"), family=compiler.family)
    command = [*compiler.argv, *compiler.link, *options, "-o", str(elf), *map(str, objects)]
    run = subprocess.run(
        command, cwd=root, capture_output=True, text=True, encoding="utf-8", errors="replace", stdin=subprocess.DEVNULL
    )
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
