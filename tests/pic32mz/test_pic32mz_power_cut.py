"""The power goes at every single flash operation of a change: afterwards all old or all new values are there. And
bits flip in the flash: afterwards the values are there, or the machine is locked and says so."""

from __future__ import annotations

import random
import re

import pytest
from chip_controller import Controller, PowerIsOff
from slow import deep_but
from store_pages import full_page, pages, prepared
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import FLASH_SIZE, STORE_OFFSET, STORE_SIZE, Torn

__all__ = ["full_page"]


def stored(controller: Controller) -> tuple[str, str]:
    """$100 and $101 after a power-on; nothing is reported damaged."""
    controller.chip.power_on()
    controller.boot()
    said = controller.send("$$")
    return tuple(re.findall(r"\$10[01]=([\d.]+)", said))  # type: ignore[return-value]


EVERY = 3
IN_CI = pytest.mark.parametrize("first", deep_but((1).__eq__, range(1, 1 + EVERY)))  # of the operations


def cut_everywhere(
    board: Board, image: tuple[Block, ...], before: bytes, torn: Torn, first: int
) -> set[tuple[str, str]]:
    """Change $100 with the power cut at the first operation and each third one after it until none is left."""
    found = set()
    with prepared(board, image, before) as controller:
        controller.chip.save()
        for nth in range(first, 300, EVERY):
            controller.chip.restore()
            controller.chip.cut_power(nth, torn)
            try:
                controller.fine("$100=999")
            except PowerIsOff:
                found.add(stored(controller))
                controller.fine("$100=888")  # and it can be written again
                assert stored(controller)[0] == "888.000"
                continue
            assert nth > 5
            return found
    raise AssertionError("more operations than a change can have")


@pytest.mark.slow
@IN_CI
@pytest.mark.parametrize("torn", deep_but(Torn.AMID.__eq__, Torn))
def test_first_change_of_a_blank_chip(board: Board, image: tuple[Block, ...], torn: Torn, first: int) -> None:
    """Also the very first one erases, writes, and puts the page's head last."""
    found = cut_everywhere(board, image, b"\xff" * STORE_SIZE, torn, first)
    assert found <= {("250.000", "250.000"), ("999.000", "250.000")}


@pytest.mark.slow
@IN_CI
@pytest.mark.parametrize("torn", deep_but(Torn.AMID.__eq__, Torn))
def test_change_that_moves_to_the_other_page(
    board: Board, image: tuple[Block, ...], full_page: bytes, torn: Torn, first: int
) -> None:
    with prepared(board, image, full_page) as controller:
        old = stored(controller)
    found = cut_everywhere(board, image, full_page, torn, first)
    assert old[1] == "77.000" and found <= {old, ("999.000", "77.000")}
    assert old in found


def test_nothing_but_the_two_pages_is_written(board: Board, image: tuple[Block, ...], full_page: bytes) -> None:
    with prepared(board, image, full_page) as controller:
        before = controller.chip.flash()
        controller.fine("$100=500", "G10L2P1X1", "$N0=G21")
        after = controller.chip.flash()
    assert len(before) == FLASH_SIZE and pages_out(before) == pages_out(after) and before != after


def pages_out(flash: bytes) -> bytes:
    return flash[:STORE_OFFSET] + flash[STORE_OFFSET + STORE_SIZE :]


def shown(controller: Controller) -> str:
    return "".join(controller.send(line) for line in ("$$", "$#", "$N")).split("[TLO")[0]


@pytest.mark.slow
def test_no_flipped_bit_is_silent(board: Board, image: tuple[Block, ...], full_page: bytes) -> None:
    """Of the pages as they are after a change of page, so that older values are there to come back."""
    with prepared(board, image, full_page) as controller:
        controller.fine("$100=640", "$110=1234", "G10L2P3X1.5", "$N0=G21", "$100=641")
        whole, right = pages(controller), shown(controller)
    written = [at for at, byte in enumerate(whole) if byte != 0xFF]
    chance, damaged = random.Random(14), 0
    for _ in range(60):
        flipped = bytearray(whole)
        flipped[chance.choice(written)] ^= 1 << chance.randrange(8)
        with Controller(board, image) as controller:
            controller.chip.set_flash(STORE_OFFSET, bytes(flipped))
            controller.chip.power_on()
            said = controller.run(0.3)
            if "[MSG:Stored data is damaged: " in said:
                damaged += 1
                assert controller.state() == "Alarm" and controller.send("$X").endswith("error:7\r\n")
                assert controller.send("$ACK").endswith("ok\r\n")
                assert pages(controller)[-len(whole) // 3 :].rstrip(b"\xff") in bytes(flipped)
                assert controller.send("$X").endswith("ok\r\n")
            else:
                assert shown(controller) == right
    assert damaged > 0


def test_a_restored_chip_does_the_same_again(board: Board, image: tuple[Block, ...]) -> None:
    """Saved in the middle of a move: the rest of it, the answers, what is stored meanwhile, and the clock."""
    with prepared(board, image, b"\xff" * STORE_SIZE) as controller:
        controller.fine("G91G1X5F3000")
        controller.run(0.1)
        controller.steps()
        controller.chip.save()
        before, found = pages(controller), []
        for _ in range(3):
            said = controller.send("G10L2P1X5") + controller.send("$$") + controller.run(1.0) + controller.status()
            found.append((said, controller.steps().tobytes(), pages(controller), controller.chip.cycles))
            controller.chip.restore()
            assert pages(controller) == before and controller.stands()[0] not in (0, 1250)
    assert found[0][2] != before and len(found[0][1]) > 1000
    assert found[1] == found[0] and found[2] == found[0]
