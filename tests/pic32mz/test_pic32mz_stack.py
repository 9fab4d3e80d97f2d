"""The stack's high-water mark of gcc's image; that of zig's is in test_pic32mz_zig.py."""

from __future__ import annotations

from chip_controller import BANNER, Controller
from stack_use import DEEPEST, STACK_BUDGET, paint_stack, stack_used
from wificnc.board.model import Board
from wificnc.build.image import read_hex
from wificnc.build.pic32mz import Pic32Build


def test_high_water_mark(board: Board, build: Pic32Build) -> None:
    with Controller(board, read_hex(build.hex.read_text())) as controller:
        paint_stack(controller, build)
        assert controller.boot() == BANNER
        for line in DEEPEST:
            controller.send(line)
        controller.rest()
        assert 0 < stack_used(controller, build) <= STACK_BUDGET
