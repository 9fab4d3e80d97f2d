"""`wificnc nvs build --board`: pins of `--set` obey the rules of board files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.errors import BoardError, Exit
from wificnc.firmware.nvs.fit import check_pins
from wificnc.firmware.nvs.values import number_entry

WROOM, S3, SHIFTED = "esp32-wroom32", "esp32s3-devkitc", "jackpot"


def check(board: str, *keys: str) -> None:
    check_pins(load_board(board), [number_entry(key) for key in keys])


@pytest.mark.parametrize(
    ("board", "keys", "reason"),
    [
        (WROOM, ("p_sx=34",), "GPIO34 can only be read"),
        (WROOM, ("p_sx=6",), "belongs to"),
        (WROOM, ("p_sx=99",), "has no GPIO99"),
        (WROOM, ("p_sx=24",), "has no GPIO24"),
        (WROOM, ("p_sx=27", "p_sy=27"), "is at GPIO27, too"),
        (WROOM, ("p_sx=26",), "is at GPIO26, too"),  # where step_y stays
        (S3, ("p_sx=25",), "has no GPIO25"),  # of an ESP32
        (S3, ("p_sx=33",), "belongs to"),
        (SHIFTED, ("p_sx=4",), "is fixed by the board"),
        (SHIFTED, ("p_dz=4",), "is fixed by the board"),
    ],
)
def test_a_pin_that_breaks_a_rule_is_refused_with_it(board: str, keys: tuple[str, ...], reason: str) -> None:
    with pytest.raises(BoardError) as caught:
        check(board, *keys)
    assert reason in str(caught.value) and keys[0] in str(caught.value)


@pytest.mark.parametrize(
    ("board", "keys"),
    [
        (WROOM, ()),
        (WROOM, ("p_sx=25",)),
        (WROOM, ("p_sx=26", "p_sy=25")),
        (WROOM, ("p_est=255",)),
        (S3, ("in_door=0",)),
    ],
)
def test_pins_that_fit_pass(board: str, keys: tuple[str, ...]) -> None:
    """Also two that change places."""
    check(board, *keys)


def test_all_that_is_wrong_is_named_in_one_run(tmp_path: Path) -> None:
    image = tmp_path / "nvs.bin"
    args = ["nvs", "build", "shapeoko3", "--board", WROOM, "--set", "p_sx=34", "--set", "p_sy=99", "-o", str(image)]
    result = CliRunner().invoke(root, args)
    assert isinstance(result.exception, BoardError) and result.exception.exit_code == Exit.BOARD
    assert "p_sx=34" in str(result.exception) and "p_sy=99" in str(result.exception) and not image.exists()


# -- without a board: what every chip of ours refuses


def built(folder: Path, *keys: str) -> Result:
    sets = [word for key in keys for word in ("--set", key)]
    return CliRunner().invoke(root, ["nvs", "build", "shapeoko3", *sets, "-o", str(folder / "nvs.bin"), "--json"])


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        (("p_sx=99",), "ESP32-S3 has no GPIO99"),
        (("p_sx=55",), "has no GPIO55"),
        (("p_sx=254",), "has no GPIO254"),
        (("p_sx=24",), "has no GPIO24"),
        (("p_sx=29",), "GPIO29"),  # an ESP32 has none, on an ESP32-S3 it is the flash's
        (("p_sx=27", "p_sy=27"), "p_sx is at GPIO27, too"),
        (("p_sx=27", "p_en=27"), "p_sx is at GPIO27, too"),
        (("p_sx=39", "p_sy=25"), "GPIO39 of the ESP32 can only be read"),  # an ESP32-S3 has no GPIO25
    ],
)
def test_without_a_board_no_chip_may_refuse_all(keys: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    done = built(tmp_path, *keys)
    assert isinstance(done.exception, BoardError)
    assert reason in str(done.exception) and "--board" in str(done.exception.hint)
    assert not (tmp_path / "nvs.bin").exists()


@pytest.mark.parametrize(
    ("keys", "chips"),
    [
        (("p_sx=25",), ["ESP32"]),
        (("p_sx=4", "p_sy=5"), ["ESP32", "ESP32-S3"]),
        (("p_lx=34",), ["ESP32", "ESP32-S3"]),
        (("p_sx=255", "p_sy=255"), []),
        (("in_door=0",), []),
    ],
)
def test_without_a_board_the_report_names_the_chips(keys: tuple[str, ...], chips: list[str], tmp_path: Path) -> None:
    done = built(tmp_path, *keys)
    assert done.exit_code == Exit.OK
    assert ("--board" in done.stderr) is bool(chips)
    assert json.loads(done.stdout)["pins_fit"] == chips


def test_with_a_board_the_report_names_it(tmp_path: Path) -> None:
    args = ["nvs", "build", "shapeoko3", "--board", WROOM, "--set", "p_sx=25", "-o", str(tmp_path / "a.bin"), "--json"]
    assert json.loads(CliRunner().invoke(root, args).stdout)["pins_fit"] == [WROOM]
