"""Stores of older firmware: values come along one by one, and what cannot be kept is named.

old_stores/ holds what the firmware before `9ea60c7` (November 2026: layout 1 of the settings, of the PC's file, of the
PIC32MZ's pages) has written for LINES: never edit it.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest
from chip_controller import Controller, PowerIsOff
from grbl_host import Grbl
from image_fixture import board, build, image
from slow import deep_but
from test_damaged_store import DAMAGED, SETTINGS, STARTUP, file_of, records, sealed
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import STORE_OFFSET, Torn, load_store

__all__ = ["board", "build", "image"]

EVERY = 4
OLD = Path(__file__).resolve().parent / "old_stores"
LINES = ("$100=640", "$101=77.5", "$110=1234.5", "$10=3", "$22=1", "$23=5", "$20=1", "G10L2P3X1.5Y-2", "G10L2P9X3")
LINES += ("G10L1P5Z-3", "G28.1", "$N0=G21", "$N1=G90", "$I=SHOP")
KEPT = ("$100=640.000", "$101=77.500", "$110=1234.500", "$10=3", "$22=1", "$23=5", "$20=1", "[G56:1.500,-2.000,0.000")
KEPT += ("[G59.3:3.000,0.000,0.000", "$N0=G21", "$N1=G90", ":SHOP]")


def shown(controller: Grbl | Controller, end: str) -> str:
    return "".join(controller.send(line + end) for line in ("$$", "$#", "$N", "$I", "G43H5", "$#"))


def check(said: str, all_shown: str) -> None:
    """Everything is there, and nothing is called damaged; homing is on, so it starts locked as ever."""
    assert "damaged" not in said and "error" not in said, said
    assert all(value in all_shown for value in KEPT), [value for value in KEPT if value not in all_shown]


def pc(store: Path) -> tuple[Grbl, str]:
    controller = Grbl(store=store)
    return controller, controller.send("")


def test_pc_store_of_layout_1(tmp_path: Path) -> None:
    store = tmp_path / "kept"
    store.write_bytes((OLD / "pc_layout_1.bin").read_bytes())
    for again in range(3):
        controller, said = pc(store)
        check(said, shown(controller, "\n").replace("error:9", ""))
        controller.send("$X\n")
        assert controller.send(f"$102={300 + again}\n").endswith("ok\r\n")  # now it is of the present layout
        controller.close()
    assert records(store.read_bytes())[SETTINGS][4] == 2


def test_pc_store_of_layout_1_with_damage_says_so(tmp_path: Path) -> None:
    """Whatever byte of the settings it is."""
    store = tmp_path / "kept"
    whole = records((OLD / "pc_layout_1.bin").read_bytes())
    for at in range(0, len(whole[SETTINGS]), 29):
        value = bytearray(whole[SETTINGS])
        value[at] ^= 4
        store.write_bytes(file_of({**whole, SETTINGS: bytes(value)}))
        controller, said = pc(store)
        assert DAMAGED + "settings $0" in said and "[G56:1.500,-2.000" in controller.send("$#\n")
        controller.close()


@pytest.mark.parametrize("layout", [1, 2])
def test_one_value_out_of_a_narrower_range_does_not_take_the_others_along(tmp_path: Path, layout: int) -> None:
    """As a firmware finds it whose $76 (10 to 1000 ms) and $24 had a wider range before."""
    store = tmp_path / "kept"
    store.write_bytes((OLD / "pc_layout_1.bin").read_bytes())
    whole = records(store.read_bytes())
    pairs = dict(struct.iter_unpack("<Hf", whole[SETTINGS][8:]))
    pairs[76], pairs[24] = 5000.0, 0.0
    if layout == 1:
        payload = b"".join(struct.pack("<Hf", *pair) for pair in pairs.items())
    else:
        payload = b"".join(checked(number, value) for number, value in pairs.items())
    store.write_bytes(file_of({**whole, SETTINGS: sealed(payload, layout)}))
    controller, said = pc(store)
    assert DAMAGED + "settings $24 $76." in said.replace(",", ".")
    all_shown = shown(controller, "\n")
    assert all(value in all_shown for value in KEPT)
    assert "<Alarm|" in controller.send("?") and controller.send("$X\n").endswith("error:7\r\n")
    assert controller.send("$ACK\n").endswith("ok\r\n")
    controller.close()
    controller, said = pc(store)
    check(said, shown(controller, "\n").replace("error:9", ""))
    controller.close()


def checked(number: int, value: float) -> bytes:
    """A setting as layout 2 has it."""
    check = zlib.crc32(struct.pack("<HHf", number, 0, value)) & 0xFFFF
    return struct.pack("<HHf", number, check, value)


@pytest.mark.parametrize("name", ["pic32mz_layout_1", "pic32mz_layout_1_second_page"])
def test_pic32mz_pages_of_layout_1(board: Board, image: tuple[Block, ...], name: str) -> None:
    with Controller(board, image) as controller:
        controller.chip.set_flash(STORE_OFFSET, (OLD / f"{name}.bin").read_bytes())
        for again in range(3):
            controller.chip.power_on()
            said = controller.run(0.1)
            check(said, shown(controller, "").replace("error:9", ""))
            controller.send("$X")
            assert controller.send(f"$102={300 + again}").endswith("ok\r\n")  # now it is of the present layout
        pages = controller.chip.flash()[STORE_OFFSET : STORE_OFFSET + 0x8000]
        assert b"WFG2" in (pages[:4], pages[0x4000:0x4004])


@pytest.mark.deep
@pytest.mark.parametrize("first", deep_but((1).__eq__, range(1, 1 + EVERY)))
def test_power_cuts_while_pic32mz_pages_are_migrated(board: Board, image: tuple[Block, ...], first: int) -> None:
    """At every operation of the first write, in CI at every fourth: all values are the old ones, or the new one is
    there as well."""
    pages = (OLD / "pic32mz_layout_1_second_page.bin").read_bytes()
    for nth in range(first, 400, EVERY):
        with Controller(board, image) as controller:
            controller.chip.set_flash(STORE_OFFSET, pages)
            controller.chip.power_on()
            controller.run(0.05)
            controller.send("$X")
            controller.chip.cut_power(nth, Torn(nth % 3))
            try:
                controller.send("$102=333")
            except PowerIsOff:
                controller.chip.power_on()
                said = controller.run(0.1)
                check(said, shown(controller, "").replace("error:9", ""))
                continue
            assert nth > 50
            return
    raise AssertionError("more operations than a change can have")


def test_pages_of_a_virtual_chip_of_before(tmp_path: Path, board: Board, image: tuple[Block, ...]) -> None:
    """`wificnc serve --settings FILE`: two pages, where there are three now."""
    with Controller(board, image) as controller:
        load_store(controller.chip, OLD / "pic32mz_layout_1.bin")
        controller.chip.power_on()
        check(controller.run(0.1), shown(controller, "").replace("error:9", ""))


def test_startup_lines_of_layout_1_without_settings_are_there(tmp_path: Path) -> None:
    """A file that may be of layout 1 or cut off: what is there counts, and the rest is called missing."""
    store = tmp_path / "kept"
    whole = records((OLD / "pc_layout_1.bin").read_bytes())
    store.write_bytes(file_of({STARTUP: whole[STARTUP]}))
    controller, said = pc(store)
    assert DAMAGED in said and "$N0=G21" in controller.send("$N\n")
    controller.close()
