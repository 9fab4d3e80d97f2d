"""Single cells of the table of states on the PIC32MZ's real image: those that the board has inputs for."""

from __future__ import annotations

import pytest
from chip_grbl import ChipGrbl
from generate.states_table import load_states
from grbl_host import BANNER, Grbl
from image_fixture import ALL_ON_CHIP
from state_machine import SITUATIONS, Pair
from wificnc.board.model import Board
from wificnc.build.image import Block

TABLE = load_states()
NOT_THERE = {"hold_button", "start_button", "reset_button", "door_opens", "door_closes", "sender_lost"}
NO_MIST = {"mist_byte"}
NOT_THERE |= {entry.name for entry in TABLE.packets} | {"host_lost", "dial", "pendant_line", "m1_switch"}  # no network
LONG = {"lost", "door_open", "door_closed"}  # a door's restoring takes 5 s
ALWAYS = [
    ("run", "home_line"),
    ("run", "jog_line"),
    ("run", "hold_byte"),
    ("run", "estop_pressed"),
    ("hold, move", "home_line"),
    ("hold, move", "resume_byte"),
    ("hold, M0", "resume_byte"),
    ("parked, M6", "resume_byte"),
    ("parked_moves", "hold_byte"),
    ("jog", "cancel_byte"),
    ("jog", "move"),
    ("check", "move"),
    ("home", "reset_byte"),
    ("alarm", "unlock"),
    ("critical", "ask_settings"),
    ("critical", "unlock"),
    ("estop", "reset_byte"),
    ("sleep", "move"),
]
EVERY = [
    (situation, name)
    for situation, way in SITUATIONS.items()
    for name in (entry.name for entry in TABLE.controllers)
    if situation.split(",")[0] not in LONG
    and not (NOT_THERE | {"door_byte"}) & set(way)
    and name not in NOT_THERE | NO_MIST
]


class ChipPair(Pair):
    """The image in the virtual chip, and the model."""

    settled_s = 0.8

    def __init__(self, board: Board, image: tuple[Block, ...]) -> None:
        self._board, self._image = board, image
        super().__init__(TABLE)

    def start(self) -> Grbl:
        grbl = ChipGrbl(self._board, self._image)
        assert grbl.after(0.02) == BANNER
        return grbl  # type: ignore[return-value]  # it has the same methods

    def shown(self) -> str:
        silent = self.table.states[self.model.state].silent
        return self.model.report if silent else self.grbl.state()


@pytest.mark.alike(6)
@pytest.mark.parametrize(("situation", "name"), EVERY if ALL_ON_CHIP else ALWAYS)
def test_cell_on_chip(board: Board, image: tuple[Block, ...], situation: str, name: str) -> None:
    pair = ChipPair(board, image)
    pair.reach(situation)
    pair.step(name)
    pair.close()
