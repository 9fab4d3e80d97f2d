"""C files to Xtensa objects: clang to LLVM code, llc to machine code of the ESP32's processor."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from wificnc.build.frames import frame_flags, frame_limit

from xtensa.headers import Headers
from xtensa.toolchain import Toolchain
from xtensa.unchanged import depfile, files_read, is_unchanged, note

# LLVM knows the ESP32's LX6, not the S3's LX7. For what is proved here they are alike: windowed registers, a
# single-precision unit, s32c1i.
CPU = "esp32"

# The integer types are those of Espressif's gcc, so that format strings are judged as there.
FLAGS = (
    "--target=xtensa-none-elf",
    "-std=gnu17",
    "-O2",
    "-nostdlibinc",
    "-ffunction-sections",
    "-fno-jump-tables",
    "-fomit-frame-pointer",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-D__XTENSA_WINDOWED_ABI__=1",
    "-DESP_PLATFORM",
    "-D_GNU_SOURCE",
    "-U__INT32_TYPE__",
    "-D__INT32_TYPE__=long int",
    "-U__UINT32_TYPE__",
    "-D__UINT32_TYPE__=long unsigned int",
    "-Wall",
    "-Wextra",
    "-Wshadow",
    "-Werror",
)

# A choice between two float constants becomes a table of them, which LLVM 22 cannot address on Xtensa; without
# optimisation it stays a branch.
LLC_GAP = "Cannot select"

# What llc makes, each by a call of its own that takes a third of a file's time.
Kind = Literal["obj", "asm"]
BOTH: tuple[Kind, ...] = ("obj", "asm")

FOLDERS = ("core", "targets/chip", "targets/net", "targets/esp32")
EXCLUDED = ("targets/esp32/test/",)


OF_THE_BOARD = re.compile(
    r'#include "(pin_config|hal/hal_step|hal/step_(engine|shift|rmt|vector)|hal/shift_port|step/isr|step/load'
    r'|io/output_cut|app/restart_note)\.h"'
)


@dataclass(frozen=True)
class Object:
    """A compiled file, or what the compiler said."""

    source: Path
    path: Path
    said: str = ""

    @property
    def code(self) -> Path:
        """LLVM code."""
        return self.path.with_suffix(".ll")

    @property
    def assembly(self) -> Path:
        """The object as text."""
        return self.path.with_suffix(".s")


def firmware_sources(root: Path) -> list[Path]:
    """Every C file of the firmware."""
    found = [path for folder in FOLDERS for path in (root / folder).rglob("*.c")]
    return sorted(path for path in found if not str(path.relative_to(root)).startswith(EXCLUDED))


def board_sources(root: Path) -> list[Path]:
    """The files that come out otherwise for each board, and what the step interrupt and a panic are made of."""
    return [path for path in firmware_sources(root) if OF_THE_BOARD.search(path.read_text())]


CALL0 = re.compile(r'wificnc_call0 INCLUDE REGEX "(.+)"')


def has_call0_abi(root: Path, source: Path) -> bool:
    """Whether board.cmake compiles this file for the step interrupt's vector."""
    found = CALL0.search((root / "targets/esp32/board.cmake").read_text())
    assert found
    return re.search(found[1], str(source)) is not None


def compile_all(
    tools: Toolchain,
    root: Path,
    headers: Headers,
    sources: Sequence[Path],
    output: Path,
    twin: Path | None = None,
    *,
    kinds: Sequence[Kind] = BOTH,
) -> list[Object]:
    """Compile each source; a failed one has `said`. @param twin  output of another chip: objects are taken from there
    where they would be the same. kinds  what is needed of Object.path and Object.assembly"""
    includes = [f"-I{path}" for path in (headers.generated, *(root / folder for folder in FOLDERS))]
    includes += [flag for path in headers.system for flag in ("-isystem", str(path))]
    argv = [tools.clang, *FLAGS, *headers.flags, *includes]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda source: _compile(tools, argv, root, source, output, twin, kinds), sources))


def _compile(
    tools: Toolchain,
    argv: Sequence[str],
    root: Path,
    source: Path,
    output: Path,
    twin: Path | None,
    kinds: Sequence[Kind],
) -> Object:
    made = Object(source, output / source.relative_to(root).with_suffix(".o"))
    made.path.parent.mkdir(parents=True, exist_ok=True)
    frame = frame_flags(frame_limit(source, root), family="clang")
    clang = [
        *argv,
        *frame,
        "-emit-llvm",
        "-S",
        "-MD",
        "-MF",
        str(depfile(made.path)),
        "-o",
        str(made.code),
        str(source),
    ]
    llc = [tools.llc, f"-mcpu={CPU}", "-O2", "--function-sections", "--data-sections", str(made.code)]
    call0 = has_call0_abi(root, source)
    command = [*clang, *llc, str(call0)]
    wanted = {kind: made.path if kind == "obj" else made.assembly for kind in kinds}
    if all(path.is_file() for path in wanted.values()) and is_unchanged(next(iter(wanted.values())), command):
        return made
    if twin and _take(made, command, output, twin):
        note(made.path, command)
        return made
    said = _translate(clang, llc, made, call0, wanted)
    if LLC_GAP in said:
        said = _translate([*clang, "-O0"], llc, made, call0, wanted)
    if not said:
        note(made.path, command)
    return Object(source, made.path, said)


def _take(made: Object, command: Sequence[str], output: Path, twin: Path) -> bool:
    """Copy what the same command made of the same source in another folder, unless it read what is generated there.
    @return whether it did"""
    there = Object(made.source, twin / made.path.relative_to(output))
    if not is_unchanged(there.path, [word.replace(str(output), str(twin)) for word in command]):
        return False
    if any(path.is_relative_to(twin) for path in files_read(there.path)):
        return False
    for path in (there.path, there.code, there.assembly, depfile(there.path)):
        shutil.copyfile(path, made.path.with_suffix(path.suffix))
    return True


def _translate(clang: Sequence[str], llc: Sequence[str], made: Object, call0: bool, wanted: Mapping[Kind, Path]) -> str:
    """@param wanted  files that llc makes. @return what clang or llc complain about."""
    run = _run(clang)
    if run.returncode != 0 or run.stderr:
        return run.stderr or f"clang failed with {run.returncode}"
    made.code.write_text(_for_cpu(made.code.read_text(), call0))
    for old in (made.path, made.assembly):
        old.unlink(missing_ok=True)  # not of this code
    for kind, path in wanted.items():
        run = _run([*llc, f"-filetype={kind}", "-o", str(path)])
        if run.returncode != 0 or run.stderr:
            return run.stderr or f"llc failed with {run.returncode}"
    return ""


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)


def _for_cpu(code: str, call0: bool) -> str:
    """Name the processor and the ABI in every function's attributes: clang cannot be told."""
    code = re.sub(r'"target-(?:cpu|features)"="[^"]*"', "", code)
    cpu = f'"target-cpu"="{CPU}"' + (' "target-features"="-windowed"' if call0 else "")
    return re.sub(r"^(attributes #\d+ = \{)", rf"\1 {cpu}", code, flags=re.MULTILINE)


def static_ram_of_board(tools: Toolchain, root: Path, headers: Headers, others: Sequence[Object], output: Path) -> int:
    """Of another board with the same chip: only what differs is compiled. @param others  objects of the chip's board.

    Raises RuntimeError when a file does not compile.
    """
    own = compile_all(tools, root, headers, board_sources(root), output, kinds=("obj",))
    if said := [made.said for made in own if made.said]:
        raise RuntimeError("\n".join(said))
    sources = {made.source for made in own}
    return static_ram_bytes(tools, [*own, *(made for made in others if made.source not in sources)])


RAM_SECTIONS = re.compile(r"^\s*\d+\s+\.(?:bss|data|dram1|noinit)\S*\s+([0-9a-f]+)", re.MULTILINE)


IMAGE_SECTIONS = re.compile(r"^\s*\d+\s+\.(?:text|rodata|iram1|data|dram1)\S*\s+([0-9a-f]+)", re.MULTILINE)


def static_ram_bytes(tools: Toolchain, objects: Sequence[Object]) -> int:
    """RAM that our own objects take before anything runs, code in RAM not counted."""
    return _section_bytes(tools, objects, RAM_SECTIONS)


def image_bytes(tools: Toolchain, objects: Sequence[Object]) -> int:
    """Code and constants of our own objects, before a linker leaves out what no one calls. The page is not in it."""
    return _section_bytes(tools, objects, IMAGE_SECTIONS)


def _section_bytes(tools: Toolchain, objects: Sequence[Object], sections: re.Pattern[str]) -> int:
    command = [tools.objdump, "-h", *(str(made.path) for made in objects)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return sum(int(size, 16) for size in sections.findall(said))
