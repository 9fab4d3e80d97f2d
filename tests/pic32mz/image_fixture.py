"""The real image of the PIC32MZ board, built once, for whoever's tests run it.

Tests of other folders that run against the host's controller run against the image as well, a few of them at any time,
all with WIFICNC_ON_CHIP=all (make test-chip).
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.build.mips import find_compiler
from wificnc.build.pic32mz import Pic32Build, build_pic32mz
from wificnc.chip.image import Block, read_hex
from wificnc.errors import BuildError

BOARD = "pic32mz2048efh100"
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


@pytest.fixture(scope="session")
def build(board: Board) -> Pic32Build:
    return build_image(board)


@pytest.fixture(scope="session")
def image(build: Pic32Build) -> tuple[Block, ...]:
    return read_hex(build.hex.read_text())
