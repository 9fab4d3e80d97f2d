"""What a row of the checklist needs of a board: asked of the board's file, so that no list of rows says where it holds.

`@pytest.mark.needs("door")`: on the image of a board that lacks it, and on the PC as that board, the row is run all the
same and must fail; one that holds after all is an error.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache

import pytest
from _pytest.mark import ParameterSet
from chip_grbl import PLAN_BURST, NotOnThisBoard
from grbl_host import Grbl
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.simulator.library import HostBoard
from wificnc.simulator.serve.options import board_numbers

GRBL_LEAST_US = 3  # of $0

# need | whether a board has it, and what it is without it
FACTS: dict[str, tuple[Callable[[Board], bool], str]] = {
    "no axis A": (lambda board: "A" not in board.axes, "has an axis A, a word that the row refuses"),
    "no axis B": (lambda board: "B" not in board.axes, "has an axis B, a word that the row refuses"),
    "no own pulse of 2 us": (lambda board: own_pulse_us(board) != 2, "has a pulse of its own that is $0=2"),
}


def own_pulse_us(board: Board) -> int:
    """The `$0` below 3 that stands for the board's own pulse; any other below 3 is refused."""
    return -(-board.timing.step_pulse_ns // 1000)


def lack(board: Board, needs: Iterable[str]) -> str | None:
    """Why a row that needs all this cannot hold on the board; None: it must. A need is one of FACTS, or a signal."""
    for need in needs:
        if need in FACTS:
            has, without = FACTS[need]
            if not has(board):
                return f"{board.id} {without}"
        elif need not in board.pin_names():
            return f"{board.id} has no pin for {need}"
    return None


def needs_of(item: pytest.Item) -> list[str]:
    return [need for mark in item.iter_markers("needs") for need in mark.args]


loaded = cache(load_board)  # hundreds of tests read the same files


def pc_board(name: str) -> HostBoard:
    """The PC as this board."""
    numbers = dict(board_numbers(loaded(name)))
    numbers["axis_count"] = numbers.pop("axes")
    return HostBoard(**numbers)


class BoardGrbl(Grbl):
    """The PC as a board, with the inputs that the board's file has."""

    def __init__(self, name: str) -> None:
        self._board = loaded(name)
        self.plan_moves = self._board.look_ahead - PLAN_BURST
        super().__init__(board=pc_board(name))

    def input(self, name: str, active: bool) -> None:
        signal = re.sub(r"^limit(?:-min|-max)?-", "limit_", name)
        if signal not in self._board.pin_names():
            raise NotOnThisBoard(signal)
        super().input(name, active)


def is_needing(metafunc: pytest.Metafunc) -> bool:
    """The test, or one of its parameters, has a mark `needs`."""
    marks = list(metafunc.definition.iter_markers("parametrize"))
    rows = [row for mark in marks for row in mark.args[1] if isinstance(row, ParameterSet)]
    return any(metafunc.definition.iter_markers("needs")) or any(
        mark.name == "needs" for row in rows for mark in row.marks
    )
