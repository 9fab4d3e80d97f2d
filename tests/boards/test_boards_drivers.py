"""Motor drivers with registers: what a board file may say of them, and what the firmware gets of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board.header import pin_header_text
from wificnc.board.load import check_board, load_board
from wificnc.build.host import checkout_root

BOARDS = checkout_root() / "boards"
UART, SPI = "fysetc-e4", "xpro-v5"


@pytest.mark.parametrize(
    ("board", "old", "new", "reason"),
    [
        (UART, "address = 3", "address = 1", "driver.x has address 1 too, and both would answer"),
        (UART, "address = 3\n", "", "the address of this driver is missing"),
        (UART, 'kind = "tmc2209"\naddress = 3', 'kind = "tmc5160"\nplace = 0', "a TMC5160 is reached by SPI"),
        (UART, 'uart = "UART1"', 'uart = "UART7"', "has no 'UART7' to spare"),
        (
            UART,
            "[driver_bus]",
            '[pendant]\nuart = "UART1"\ntx = "GPIO4"\nrx = "GPIO0"\n\n[driver_bus]',
            "UART1 is the UART of the pendant",
        ),
        (UART, 'rx = "GPIO21"', "", "the bus has no rx"),
        (UART, "[driver.a]", "[driver.c]", "the board has no axis c"),
        (
            UART,
            "address = 3",
            "address = 3\ndiag = true",
            "DIAG is high in a stall, and this axis' limit is active low",
        ),
        (UART, "address = 2", "address = 2\ndiag = true", "DIAG is to be at a limit input, and this axis has none"),
        (SPI, "place = 3", "place = 4", "a chain of 4 has the places 0 to 3"),
        (SPI, "place = 3", "place = 2", "driver.z has place 2 too, and both would answer"),
        (SPI, 'cs = { pin = "GPIO17", active = "low" }', "", "nothing selects this driver"),
        (SPI, 'spi = "SPI3"', 'spi = "SPI3"\nuart = "UART1"', "a bus is a UART or an SPI controller"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(tmp_path: Path, board: str, old: str, new: str, reason: str) -> None:
    text = (BOARDS / f"{board}.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "edited.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert reason in "\n".join(str(problem) for problem in check_board(path))


@pytest.mark.parametrize(
    ("board", "rows", "number"),
    [
        (
            UART,
            "X(1, 0, 1, 0, 1, 220, 0) X(1, 1, 3, 0, 1, 220, 0) X(1, 2, 0, 0, 1, 220, 0) X(1, 3, 2, 0, 1, 220, 0)",
            1,
        ),
        (SPI, "X(2, 0, 0, 0, 4, 50, 0) X(2, 1, 1, 0, 4, 50, 0) X(2, 2, 2, 0, 4, 50, 0) X(2, 3, 3, 0, 4, 50, 0)", 2),
    ],
)
def test_the_firmware_gets_kind_axis_place_select_chain_and_resistor(board: str, rows: str, number: int) -> None:
    words = " ".join(pin_header_text(load_board(board)).split())
    assert f"#define BOARD_DRIVER_ROWS(X) {rows}" in words
    assert f"#define BOARD_DRIVER_BUS {number}" in words
