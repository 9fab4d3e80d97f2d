"""The image as a bootloader starts it: from the place that it keeps for a reset vector, its own traces left behind."""

from __future__ import annotations

import struct

import pytest
from chip_controller import BANNER, Controller
from wificnc.board.model import Board
from wificnc.build.image import Block

PLACE = 0x1D1F3FF0  # of the application's reset vector, 16 bytes before the bootloader
# lui t0, 0xBD1F; ori t0, t0, 0x3FF0; jr t0; nop
TO_THE_PLACE = struct.pack("<4I", 0x3C08BD1F, 0x35083FF0, 0x01000008, 0)
IEC, IFS = 0xBF8100C0, 0xBF810040
IRQ_USB, IRQ_T2 = 132, 9


def handed_over(image: tuple[Block, ...]) -> tuple[Block, ...]:
    (vector,) = [block.data for block in image if block.address == 0x1FC00000]
    program = [block for block in image if block.address < 0x1FC00000]
    return (*program, Block(PLACE, vector), Block(0x1FC00000, TO_THE_PLACE))


@pytest.mark.slow
def test_starts_from_the_bootloaders_place(board: Board, image: tuple[Block, ...]) -> None:
    with Controller(board, handed_over(image)) as controller:
        assert controller.boot() == BANNER


def test_what_the_bootloader_left_on_does_not_interrupt(board: Board, image: tuple[Block, ...]) -> None:
    """It uses USB and timers; their flags stand and their interrupts are on when the image starts."""
    with Controller(board, handed_over(image)) as controller:
        for irq in (IRQ_USB, IRQ_T2):
            for register in (IEC, IFS):
                controller.chip.write_register(register + 0x10 * (irq // 32), 1 << irq % 32)
            ipc = 0xBF810140 + 0x10 * (irq // 4)
            controller.chip.write_register(ipc, 0x1C << 8 * (irq % 4))
        assert controller.boot() == BANNER
        controller.fine("G91G1X1F600")
        controller.rest()
        assert controller.stands() == [250, 0, 0, 0]
