"""The real image of the PIC32MZ board, built once, for whoever's tests run it.

Tests of other folders that run against the host's controller run against the image as well, a few of them at any time,
all with WIFICNC_ON_CHIP=all (make test-chip).
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest
from wificnc.board.header import pin_header_text
from wificnc.board.load import board_path, load_board
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root
from wificnc.build.image import Block, read_hex
from wificnc.build.mips import find_compiler
from wificnc.build.pic32mz import Pic32Build, build_pic32mz
from wificnc.errors import BuildError

BOARD = "pic32mz2048efh100"
PUMP_HZ = 12_500
DIAL = """
[dial]
a = "RA2"
b = "RA3"
x10 = "RA10"
axis = { y = "RA15" }
"""
SECOND_Y = {"step": "RG1", "dir": "RG12"}
LOW = '{ pin = "%s", active = "low" }'
ALL_ON_CHIP = os.environ.get("WIFICNC_ON_CHIP") == "all"


@pytest.fixture(scope="session")
def board() -> Board:
    return load_board(BOARD)


def build_image(board: Board, output: Path | None = None) -> Pic32Build:
    """By gcc; without it the test is skipped. @param output  a folder that is not build/BOARD"""
    try:
        find_compiler("gcc")
    except BuildError as err:
        pytest.skip(err.message)
    return build_pic32mz(board, cc="gcc", output=output)


def sizes_of_core(board: Board) -> list[str]:
    """All that the core sees of a board."""
    header = checkout_root() / "targets" / "pic32mz" / "hal" / "core_sizes.h"
    names = re.findall(r"\bBOARD_\w+", header.read_text(encoding="utf-8"))
    lines = pin_header_text(board).splitlines()
    return [line for line in lines for name in names if line.split()[1:2] == [name]]


def take_core(folder: Path, output: Path) -> None:
    """Objects of a board's core, with their times, for a board with the same sizes, unless it has its own."""
    if not (output / "compiler.json").exists():
        shutil.copytree(folder / "obj" / "core", output / "obj" / "core")
        shutil.copy2(folder / "compiler.json", output)


@pytest.fixture(scope="session")
def build(board: Board) -> Pic32Build:
    return build_image(board)


@pytest.fixture(scope="session")
def image(build: Pic32Build) -> tuple[Block, ...]:
    return read_hex(build.hex.read_text())


@pytest.fixture(scope="session")
def laden_board(tmp_path_factory: pytest.TempPathFactory) -> Board:
    """One board for what no shipped one has, because each image takes half a minute: the gantry with the other board's
    spindle bus, a dial, a charge pump in place of a digital output, and active-low lines of the second motor of Y."""
    text = board_path("pic32mz-gantry").read_text(encoding="utf-8")
    changes = {f'{kind} = "{pin}"\n': f"{kind} = {LOW % pin}\n" for kind, pin in SECOND_Y.items()}
    changes['misc = ["RA9"]'] = f'charge_pump = "RA9"\ncharge_pump_hz = {PUMP_HZ}'
    for what, other in changes.items():
        assert text.count(what) == 1
        text = text.replace(what, other)
    tables = board_path(BOARD).read_text(encoding="utf-8").split("\n\n")
    bus = [table for table in tables if re.match(r'\[spindle_bus\]|\[\[deviation\]\]\nkey = "spindle_bus\.', table)]
    path = tmp_path_factory.mktemp("laden") / "pic32mz-laden.toml"
    path.write_text("\n\n".join([text + DIAL, *bus, ""]), encoding="utf-8")
    return load_board(path)


@pytest.fixture(scope="session")
def laden_image(laden_board: Board) -> tuple[Block, ...]:
    output = checkout_root() / "build" / "tests" / "pic32mz" / "laden"
    gantry = load_board("pic32mz-gantry")
    assert sizes_of_core(gantry) == sizes_of_core(laden_board)
    take_core(build_image(gantry).elf.parent, output)
    return read_hex(build_image(laden_board, output).hex.read_text())
