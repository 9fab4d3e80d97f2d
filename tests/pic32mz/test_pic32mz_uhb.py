"""`wificnc flash --tool uhb`: our end of the board's USB bootloader, against a fake of the board's end."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from types import ModuleType

import pytest
from chip_controller import BANNER, Controller
from fake_bootloader import FLASH, PAGE, FakeBootloader
from wificnc.app import main
from wificnc.board.model import Board
from wificnc.build.image import Block, write_hex
from wificnc.build.pic32mz import Pic32Build
from wificnc.errors import Exit, FlashError
from wificnc.firmware.flash.pic32mz import is_own
from wificnc.firmware.flash.uhb import HidWire, flash, plan_pages

PLACE = 0x1D1F3FF0
STORE = slice(0x180000, 0x18C000)
VECTOR = Block(0x1FC00000, bytes(range(16)))
SMALL = (Block(0x1D000180, b"program" * 3000), VECTOR, Block(0x1FC0FFC0, bytes(48)))
PACKETS = 2 * PAGE // 64 + 30


def nothing(what: str, done: int, total: int) -> None:
    pass


def used_board() -> FakeBootloader:
    """With an old program, its settings, and its bootloader."""
    board = FakeBootloader()
    board.flash[:0x8000] = b"\x12" * 0x8000
    board.flash[STORE] = b"\xa5" * 0xC000
    board.flash[0x1F0000:0x1F4000] = b"\x34" * 0x4000
    board.flash[0x1F4000:] = b"\x77" * 0xC000
    board.boot_flash[:] = b"\x99" * 0x10000
    return board


def check_kept(board: FakeBootloader) -> None:
    assert board.flash[STORE] == b"\xa5" * 0xC000 and board.flash[0x1F4000:] == b"\x77" * 0xC000
    assert board.boot_flash == b"\x99" * 0x10000 and board.refused == [] and board.twice == []


def test_an_image_is_written_and_the_rest_is_kept() -> None:
    board = used_board()
    seen: list[tuple[int, int]] = []
    record = flash(board, plan_pages(SMALL), lambda _, done, total: seen.append((done, total)))
    assert record.name == "Clicker2MZ" and record.version == 0x1200
    assert board.flash[0x180 : 0x180 + 21000] == b"program" * 3000 and board.flash[:0x180] == b"\xff" * 0x180
    assert board.flash[PLACE - FLASH : PLACE - FLASH + 16] == VECTOR.data
    assert board.reboots == 1 and seen == [(PAGE, 3 * PAGE), (2 * PAGE, 3 * PAGE), (3 * PAGE, 3 * PAGE)]
    check_kept(board)


def test_what_was_written_runs(board: Board, image: tuple[Block, ...]) -> None:
    """The real image by the fake bootloader into the virtual chip, started as the bootloader starts it."""
    written = used_board()
    written.flash[STORE] = b"\xff" * 0xC000
    flash(written, plan_pages(image), nothing)
    to_the_place = struct.pack("<4I", 0x3C08BD1F, 0x35083FF0, 0x01000008, 0)
    with Controller(board, (Block(FLASH, bytes(written.flash)), Block(0x1FC00000, to_the_place))) as controller:
        assert controller.boot() == BANNER


@pytest.mark.parametrize("packets", [0, 1, 2, 3, 4, 5, 6, 7, 100, 262, 263, 264, 500, 519, 520])
def test_lost_in_the_middle(packets: int) -> None:
    """Half a program never starts: the old one is whole, or there is no start vector. The next try succeeds."""
    board = used_board()
    board.packets_until_lost = packets
    with pytest.raises(FlashError, match=r"connection to the board was lost|does not answer") as caught:
        flash(board, plan_pages(SMALL), nothing)
    assert "reset" in (caught.value.hint or "")
    whole = board.flash[:0x8000] == b"\x12" * 0x8000
    assert whole or board.flash[PLACE - FLASH : PLACE - FLASH + 16] == b"\xff" * 16
    check_kept(board)
    board.packets_until_lost = None
    board.reset()
    flash(board, plan_pages(SMALL), nothing)
    assert board.flash[0x180 : 0x180 + 21000] == b"program" * 3000
    check_kept(board)


@pytest.mark.parametrize("code", [1, 2, 3, 11, 21])
def test_a_bootloader_that_does_not_answer(code: int) -> None:
    board = used_board()
    board.deaf_to = code
    with pytest.raises(FlashError, match="does not answer"):
        flash(board, plan_pages(SMALL), nothing)
    check_kept(board)


@pytest.mark.parametrize(
    ("board", "said"),
    [
        (FakeBootloader(family=20), "family 0x14 and not 0x15"),
        (FakeBootloader(flash_bytes=0x100000), "flash 0x100000 and not 0x200000"),
        (FakeBootloader(start=0x1D0F4000), "bootloader's address 0x1d0f4000 and not 0x1d1f4000"),
        (FakeBootloader(page=0x1000), "page 0x1000 and not 0x4000"),
    ],
)
def test_another_board_is_not_touched(board: FakeBootloader, said: str) -> None:
    with pytest.raises(FlashError, match=said) as caught:
        flash(board, plan_pages(SMALL), nothing)
    assert caught.value.hint == "nothing has been written" and board.erased == [] and board.reboots == 0


@pytest.mark.parametrize(
    ("block", "where"),
    [
        (Block(0x1D180000, b"x"), "0x1d180000"),
        (Block(0x1D187FFF, b"xx"), "0x1d187fff"),
        (Block(0x1D1F0000, b"x"), "0x1d1f0000"),
        (Block(0x1D1F4000, b"x"), "0x1d1f4000"),
        (Block(0x1FC00010, b"x"), "0x1fc00010"),
        (Block(0x1FC04000, b"x"), "0x1fc04000"),
    ],
)
def test_an_image_that_reaches_where_it_may_not(block: Block, where: str) -> None:
    with pytest.raises(FlashError, match=f"the image has bytes at {where}"):
        plan_pages([*SMALL, block])


@pytest.mark.parametrize("vector", [(), (Block(0x1FC00000, bytes(112)),)])
def test_a_reset_code_that_has_no_place(vector: tuple[Block, ...]) -> None:
    with pytest.raises(FlashError):
        plan_pages([SMALL[0], *vector])


def test_dry_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "wificnc.hex").write_text(write_hex(SMALL))
    with pytest.raises(SystemExit) as caught:
        main(["flash", "pic32mz2048efh100", "--from", str(tmp_path), "--tool", "uhb", "--dry-run"])
    assert caught.value.code == Exit.OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[:-1]] == [
        *(["erase", f"0x{address:08X}"] for address in (0x1D1F0000, 0x1D004000, 0x1D000000)),
        *(["write", f"0x{address:08X}"] for address in (0x1D000000, 0x1D004000, 0x1D1F0000)),
    ]
    assert "0x1D1F3FF0" in lines[-2] and lines[-1].startswith("untouched: the settings, the bootloader")


def test_the_plan_of_the_real_image(build: Pic32Build, image: tuple[Block, ...]) -> None:
    addresses = [page.address for page in plan_pages(image)]
    assert addresses[:-1] == list(range(FLASH, FLASH + build.flash_bytes, PAGE)) and addresses[-1] == PLACE & ~(
        PAGE - 1
    )


@pytest.mark.parametrize(
    ("tool", "program", "has_hid", "own"),
    [
        ("uhb", True, False, True),
        (None, False, True, True),
        (None, True, True, False),
        (None, False, False, False),
        ("pic32prog", False, True, False),
    ],
)
def test_when_it_is_ours(tool: str | None, program: bool, has_hid: bool, own: bool) -> None:
    assert is_own(tool, lambda name: f"/opt/{name}" if program else None, lambda: has_hid) is own


# ---- hidapi ----


class FakeHid(ModuleType):
    """PyPI's hidapi, as far as we use it: reports with their number in front, times in ms, lists of numbers."""

    def __init__(self, board: FakeBootloader | None) -> None:
        super().__init__("hid")
        self._board = board

    def device(self) -> FakeHid:
        return self

    def open(self, vendor: int, product: int) -> None:
        assert (vendor, product) == (0x1234, 1)
        if self._board is None:
            raise OSError("open failed")

    def close(self) -> None:
        pass

    def error(self) -> str:
        return "unplugged"

    def write(self, report: bytes) -> int:
        assert self._board and report[0] == 0 and len(report) == 65
        try:
            self._board.write(report[1:])
        except OSError:
            return -1
        return 65

    def read(self, size: int, timeout_ms: int) -> list[int]:
        assert self._board and size == 64 and timeout_ms > 100
        return list(self._board.read(timeout_ms / 1000))


def command(tmp_path: Path) -> int:
    (tmp_path / "wificnc.hex").write_text(write_hex(SMALL))
    with pytest.raises(SystemExit) as caught:
        main(["flash", "pic32mz2048efh100", "--from", str(tmp_path), "--tool", "uhb"])
    return int(caught.value.code or 0)


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    board = used_board()
    monkeypatch.setitem(sys.modules, "hid", FakeHid(board))
    assert command(tmp_path) == Exit.OK and board.reboots == 1
    said = capsys.readouterr().err
    assert "Clicker2MZ, bootloader 12.00" in said and "cannot read back" in said
    check_kept(board)


def test_unplugged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    board = used_board()
    board.packets_until_lost = PACKETS // 2
    monkeypatch.setitem(sys.modules, "hid", FakeHid(board))
    assert command(tmp_path) == Exit.FLASH
    assert "the connection to the board was lost while writing" in capsys.readouterr().err


def test_nothing_is_plugged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hid", FakeHid(None))
    with pytest.raises(FlashError, match="no MikroE bootloader is connected"), HidWire():
        pass


def test_without_hidapi(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hid", None)
    with pytest.raises(FlashError, match="hidapi is not installed"), HidWire():
        pass
