"""The settings' pages of the virtual chip, as a test wants them."""

from __future__ import annotations

import pytest
from chip_controller import Controller
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import STORE_OFFSET, STORE_SIZE

SERIAL_FACTOR = 16  # what is long is the port's time: $$ and $#, and hundreds of lines


def prepared(board: Board, image: tuple[Block, ...], pages: bytes) -> Controller:
    controller = Controller(board, image)
    controller.chip.set_flash(STORE_OFFSET, pages)
    controller.chip.power_on()
    controller.boot()
    return controller


@pytest.fixture(scope="module")
def full_page(board: Board, image: tuple[Block, ...]) -> bytes:
    """The settings' pages, so full that the next change of $100 goes to the other page; $101 = 77."""
    with Controller(board, image) as controller:
        controller.chip.serial_speed(SERIAL_FACTOR)
        controller.boot()
        controller.fine("$101=77", "$100=100")
        usual = cost(controller, "$100=101")
        for value in range(102, 300):
            before = pages(controller)
            if cost(controller, f"$100={value}") > usual:
                return before
    raise AssertionError("a page holds more than there is room for")


def cost(controller: Controller, line: str) -> int:
    """Flash operations that a line makes."""
    before = controller.chip.flash_operations
    controller.fine(line)
    return controller.chip.flash_operations - before


def pages(controller: Controller) -> bytes:
    return controller.chip.flash()[STORE_OFFSET : STORE_OFFSET + STORE_SIZE]
