"""The page's own unit tests, and its generated tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from wificnc.board.header import pin_header_text
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root

from web.build import install_packages, missing_tools, run_npm

ROOT = Path(__file__).resolve().parents[2]
ESP32_BOARDS = [path.stem for path in find_boards() if load_board(path).target == "esp32"]


def test_units() -> None:
    if why := missing_tools():
        pytest.skip(why)
    install_packages(checkout_root())
    said = run_npm(checkout_root(), "test", "--", "--reporter=json")
    result = json.loads(said[said.index("{") :])
    assert result["success"]
    assert result["numPassedTests"] > 0


@pytest.mark.parametrize("board_id", ESP32_BOARDS)
@pytest.mark.parametrize("kind", ["output", "input"])
def test_the_page_allows_the_pins_that_the_firmware_allows(board_id: str, kind: str) -> None:
    boards = json.loads((ROOT / "web/src/generated/boards.json").read_text())
    board = next(row for row in boards if row["id"] == board_id)
    allowed = [f"{pin['number']}u" for pin in board["pins"] if pin[kind] is None]
    define = f"BOARD_FREE_{kind.upper()}_PINS"
    line = next(line for line in pin_header_text(load_board(board_id)).splitlines() if define in line)
    assert line.split("{")[1].rstrip("}").split(", ") == allowed
    assert all(pin[kind] is None or len(pin[kind]) > 10 for pin in board["pins"]), "a refusal says why"
