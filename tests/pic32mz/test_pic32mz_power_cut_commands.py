"""Every command that stores, with the power cut at every flash operation: all of it is old, or all of it is new."""

from __future__ import annotations

import re

import pytest
from chip_controller import Controller, PowerIsOff
from image_fixture import ALL_ON_CHIP
from slow import deep_but, slow_but
from store_pages import SERIAL_FACTOR, full_page, pages, prepared
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import STORE_OFFSET, Torn

__all__ = ["full_page"]

# Something of each kind, so that each command has something to change and nothing else may.
BEFORE = ("$100=640", "$110=1234.5", "G10L2P3X1.5Y-2", "G10L2P9Z4", "G10L1P5Z-3R2(flat)", "$N0=G21", "$N1=G90")
BEFORE += ("$I=SHOP",)
COMMANDS = ("$100=77", "$22=1", "G10L2P1X5", "G10L2P8Y6", "G10L20P2X1Z2", "G10L1P7Z1R3(ball)", "G28.1", "G30.1")
COMMANDS += ("$N0=G20", "$N1=", "$I=MILL", "$RST=$", "$RST=#", "$RST=*")
QUICK = ("$100=77",)  # tests/settings cuts the power in each of them, on the PC
QUESTIONS = ("$$", "$#", "$N", "$I", "G43H5", "$#", "G43H7", "$#")
MOST = 600  # operations of a command


def shown(controller: Controller) -> str:
    """All that is stored, as a user sees it after a power-on; each start has its own number, which is not stored."""
    controller.chip.power_on()
    said = controller.run(0.05)
    assert "damaged" not in said, said
    controller.send("$X")
    said = "".join(controller.send(line) for line in QUESTIONS)
    kept, starts = re.subn(r"\[START:[0-9A-F]{8}\]\r\n", "", said)
    assert starts == 1
    return kept


@pytest.fixture(scope="module", params=deep_but("room".__eq__, ["room", "full"]))
def before(request: pytest.FixtureRequest, board: Board, image: tuple[Block, ...], full_page: bytes) -> bytes:
    """Pages with BEFORE: what comes next goes after the others, or to the other page."""
    start = full_page if request.param == "full" else b"\xff" * len(full_page)
    with prepared(board, image, start) as controller:
        controller.fine("G91G1X2F5000")
        controller.rest()
        controller.fine(*BEFORE)
        for value in range(900, 1100 if request.param == "full" else 900):
            at, now = pages(controller), controller.chip.flash_operations
            controller.fine(f"$102={value}")
            if controller.chip.flash_operations - now > 100:
                return at
        assert request.param == "room"
        return pages(controller)


def started(board: Board, image: tuple[Block, ...], start: bytes) -> Controller:
    controller = Controller(board, image)
    controller.chip.serial_speed(SERIAL_FACTOR)
    controller.chip.set_flash(STORE_OFFSET, start)
    controller.chip.power_on()
    controller.run(0.05)
    return controller


def begin(board: Board, image: tuple[Block, ...], start: bytes) -> Controller:
    """Away from zero, so that G28.1 and G30.1 have something to store."""
    controller = started(board, image, start)
    controller.send("G91G1X0.5Y0.2F5000")
    controller.rest()
    return controller


def cut(controller: Controller, command: str, nth: int, torn: Torn) -> tuple[bool, str]:
    """From save() on, with the power cut at the nth flash operation of the command.
    @return whether the command was answered before, and what is stored then"""
    controller.chip.restore()
    controller.chip.cut_power(nth, torn)
    controller.heard = ""
    with pytest.raises(PowerIsOff):
        controller.send(command)
    answered = "ok\r\n" in controller.heard
    return answered, shown(controller)


def torn_at(nth: int) -> list[Torn]:
    return list(Torn) if ALL_ON_CHIP else [Torn(nth % 3)]


@pytest.mark.alike(2)
@pytest.mark.slow
@pytest.mark.parametrize("command", slow_but(QUICK.__contains__, COMMANDS))
def test_old_or_new(board: Board, image: tuple[Block, ...], before: bytes, command: str) -> None:
    with begin(board, image, before) as controller:
        controller.chip.save()
        operations = controller.chip.flash_operations
        controller.send(command)
        operations = controller.chip.flash_operations - operations
        after = pages(controller)
        new = shown(controller)
        controller.chip.restore()
        old = shown(controller)
        assert old != new and 3 <= operations <= MOST and before != after
        found, cuts = set(), 0
        step = 1 if ALL_ON_CHIP or operations < 60 else 4
        for nth in [*range(1, operations, step), operations]:
            for torn in torn_at(nth):
                answered, now = cut(controller, command, nth, torn)
                assert now == new if answered else now in (old, new), f"operation {nth}, torn {torn.name}"
                found.add(now)
                cuts += 1
    assert old in found
    print(f"{command}: {operations} flash operations, {cuts} power cuts, none left a mix")


@pytest.mark.slow
def test_acknowledging_damage_is_one_transaction_too(board: Board, image: tuple[Block, ...], before: bytes) -> None:
    """Before it is done the damage is still reported; then the damaged value is the one that was in force."""
    damaged = bytearray(before)
    at = before.index(b"SHOP")
    damaged[at] ^= 1
    with started_damaged(board, image, bytes(damaged)) as controller:
        controller.chip.save()
        operations = controller.chip.flash_operations
        controller.send("$ACK")
        operations = controller.chip.flash_operations - operations
        new = shown(controller)
        cut_at = [*range(1, operations, 1 if ALL_ON_CHIP else 13), operations]
        for nth in cut_at:
            controller.chip.restore()
            controller.chip.cut_power(nth, Torn(nth % 3))
            with pytest.raises(PowerIsOff):
                controller.send("$ACK")
            controller.chip.power_on()
            if "Stored data is damaged: $I text" in controller.run(0.25):
                assert controller.send("$ACK").endswith("ok\r\n")
            assert shown(controller) == new, f"operation {nth} of {operations}"
    print(f"$ACK: {operations} flash operations, {len(cut_at)} power cuts, none left a mix")


def started_damaged(board: Board, image: tuple[Block, ...], start: bytes) -> Controller:
    controller = started(board, image, start)
    controller.run(0.2)
    assert "Stored data is damaged: $I text" in controller.heard
    return controller
