"""How fast the virtual PIC32MZ is, and what its real image's interrupts take: `make bench-chip`."""

from __future__ import annotations

import shutil
import struct
import sys
import time

from wificnc.board.load import load_board
from wificnc.build.image import Block
from wificnc.build.mips import COMPILER
from wificnc_chips.pic32mz import VirtualChip, board_image, wired_chip

from bench.__main__ import show
from bench.measure import Figure

METHOD = """
Processor time of mz_run(), best of three, of a program in the virtual chip's flash, eight instructions that add, mask
and jump, for ever; and of the board's real image during an arc of 20 mm radius at 3000 mm/min, with all its planning.
Interrupts: instructions from vector to eret, mean over that arc."""

BOARD = "pic32mz2048efh100"
BOOT = (0x3C199D00, 0x03200008, 0)  # lui t9, 0x9d00; jr t9; nop
LOOP = (
    *(0x24420001, 0x00621821, 0x00832025, 0x2485FFFF),  # addiu, addu, or, addiu
    *(0x00A42826, 0x30C600FF, 0x1000FFF9, 0x24E70001),  # xor, andi, b, addiu
)
PLACES = {0x1FC00000: BOOT, 0x1D000000: LOOP}
ARC = b"$110=6000\n$111=6000\nG91G2X40I20F3000\n"
VECTORS = {"step interrupt": 19, "end of a step pulse": 7}


def rate(chip: VirtualChip, seconds: float) -> float:
    """Million instructions a second, while this much of the chip's time passes."""
    before, begin = chip.instructions, time.process_time()
    chip.run(seconds)
    return (chip.instructions - before) / (time.process_time() - begin) / 1e6


def loop() -> Figure:
    image = [Block(address, struct.pack(f"<{len(code)}I", *code)) for address, code in PLACES.items()]
    with VirtualChip(image) as chip:
        return Figure("a loop", max(rate(chip, 0.5) for _ in range(3)), "M instructions/s", 200, at_least=True)


def firmware() -> list[Figure]:
    board = load_board(BOARD)
    with wired_chip(board, board_image(board)) as chip:
        chip.run(0.05)
        chip.write(ARC)
        figures = [Figure("the board's image", max(rate(chip, 0.7) for _ in range(3)), "M instructions/s")]
        for name, irq in VECTORS.items():
            vector = chip.vector(irq)
            figures.append(Figure(name, vector.instructions / vector.count, "instructions", 100))
        return figures


def main() -> int:
    print(METHOD)
    figures = show([loop()])
    if shutil.which(COMPILER):
        figures += show(firmware())
    else:
        print(f"  the board's image is not measured: there is no {COMPILER} here")
    return 0 if all(figure.is_met for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
