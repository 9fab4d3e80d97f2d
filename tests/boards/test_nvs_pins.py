"""`wificnc nvs build --board`: pins of `--set` obey the rules of board files."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.errors import BoardError, Exit
from wificnc.nvs.fit import check_pins
from wificnc.nvs.values import number_entry

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
