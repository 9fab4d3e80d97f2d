"""What programs with emulated registers of an ESP32 are compiled with."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import compiler_stamp, locate_compiler
from wificnc.build.lock import build_lock
from wificnc.build.objects import Unit, compile_stale

HERE = Path(__file__).parent
ROOT = checkout_root()
ESP32 = ROOT / "targets" / "esp32"
INCLUDES = (
    *(HERE / "registers", ESP32, ROOT / "targets" / "chip", ROOT / "targets" / "net", ROOT / "core"),
    *(ESP32 / "test" / "idf_api", HERE),
)
FLAGS = ("-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")


def chip_folder(board: Board, chip: str, folder: Path) -> Path:
    """A folder with the board's and the chip's generated headers. @param chip  whose registers they are"""
    return header_folder(pin_header_text(board), chip, folder)


def header_folder(header: str, chip: str, folder: Path) -> Path:
    """The same with this pin_config.h."""
    folder.mkdir(parents=True, exist_ok=True)
    write_if_changed(folder / "pin_config.h", header)
    values = {
        f"CONFIG_IDF_TARGET_{chip.upper()}": 1,
        "CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ": 240,
        "CONFIG_FREERTOS_HZ": 1000,
    }
    write_if_changed(folder / "sdkconfig.h", "".join(f"#define {name} {value}\n" for name, value in values.items()))
    return folder


def build_folder(name: str) -> Path:
    """Where objects of this compiler and these flags are kept."""
    argv = locate_compiler()
    stamp = hashlib.sha256(json.dumps([compiler_stamp(argv), FLAGS, list(map(str, INCLUDES))]).encode())
    return ROOT / "build" / "tests" / "esp32" / stamp.hexdigest()[:16] / name


def objects(sources: Sequence[Path], headers: Path) -> list[Path]:
    """Compiled where stale. @param headers  of chip_folder(); the objects that these change lie there, the others are
    every board's"""
    everyones = headers.parent / "every_board"
    units = []
    for source in sources:
        folder = headers if source in sources_of_a_board(tuple(sources)) else everyones
        units.append(Unit(source, folder / source.relative_to(ROOT).with_suffix(".o")))
    command = [*locate_compiler(), *FLAGS, *(f"-I{path}" for path in (headers, *INCLUDES))]
    with build_lock(headers.parent):
        compile_stale(command, units, "emulated registers")
    return [unit.object for unit in units]


@cache
def sources_of_a_board(sources: tuple[Path, ...]) -> set[Path]:
    """Those that read a generated header, which are not there for this question (-MG)."""
    command = [*locate_compiler(), *FLAGS, *(f"-I{path}" for path in INCLUDES), "-MM", "-MG", *map(str, sources)]
    rules = subprocess.run(command, capture_output=True, text=True, check=True).stdout.replace("\\\n", " ")
    read = [set(rule.split()[1:]) for rule in rules.splitlines()]
    return {source for source, names in zip(sources, read, strict=True) if names & {"pin_config.h", "sdkconfig.h"}}
