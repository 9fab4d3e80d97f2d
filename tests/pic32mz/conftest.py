"""The real image of the PIC32MZ board in the virtual chip."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from chip_controller import Controller
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.build.pic32mz import COMPILER, Pic32Build, build_pic32mz, find_compiler
from wificnc.chip.image import Block, read_hex
from wificnc.errors import BuildError

BOARD = "pic32mz2048efh100"


@pytest.fixture(scope="session")
def board() -> Board:
    return load_board(BOARD)


@pytest.fixture(scope="session")
def build(board: Board) -> Pic32Build:
    try:
        find_compiler()
    except BuildError:
        pytest.skip(f"{COMPILER} is not on this machine")
    return build_pic32mz(board)


@pytest.fixture(scope="session")
def image(build: Pic32Build) -> tuple[Block, ...]:
    return read_hex(build.hex.read_text())


@pytest.fixture
def controller(board: Board, image: tuple[Block, ...]) -> Iterator[Controller]:
    """Booted, its banner read; 5000 mm/min, 500 mm/s2."""
    with Controller(board, image) as controller:
        controller.boot()
        for axis in range(len(board.axes)):
            controller.fine(f"$11{axis}=5000", f"$12{axis}=500")
        yield controller
