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


@pytest.mark.parametrize(("left_out", "named"), [("y", "y2"), ("y2", "y"), ("", "")])
def test_both_motors_of_a_gantry_have_registers_or_neither(tmp_path: Path, left_out: str, named: str) -> None:
    """Else one has the microsteps of `$151` and the other those of its pins."""
    text = (BOARDS / f"{UART}.toml").read_text(encoding="utf-8")
    text = text.replace("[axis.a]", "[axis.y.second]").replace("[driver.a]", "[driver.y2]")
    if left_out:
        before, _, after = text.partition(f"[driver.{left_out}]")
        text = before + after.partition("sense_mohm")[2].partition("\n")[2]
    path = tmp_path / "gantry.toml"
    path.write_text(text, encoding="utf-8")
    found = [(problem.rule, problem.key) for problem in check_board(path)]
    assert found == [("drivers", f"driver.{named}")] * bool(named)


@pytest.mark.parametrize(
    ("board", "rows", "number"),
    [
        (
            UART,
            "X(1, 0, 0, 1, 0, 1, 110, 0) X(1, 1, 0, 3, 0, 1, 110, 0) X(1, 2, 0, 0, 0, 1, 110, 0) "
            "X(1, 3, 0, 2, 0, 1, 110, 0)",
            1,
        ),
        (
            SPI,
            "X(2, 0, 0, 0, 0, 4, 50, 0) X(2, 1, 0, 1, 0, 4, 50, 0) X(2, 2, 0, 3, 0, 4, 50, 0) "
            "X(2, 3, 0, 2, 0, 4, 50, 0)",
            2,
        ),
    ],
)
def test_the_firmware_gets_kind_axis_motor_place_select_chain_and_resistor(board: str, rows: str, number: int) -> None:
    words = " ".join(pin_header_text(load_board(board)).split())
    assert f"#define BOARD_DRIVER_ROWS(X) {rows}" in words
    assert f"#define BOARD_DRIVER_BUS {number}" in words


GANTRY = (("[axis.a]", "[axis.y.second]"), ("[driver.a]", "[driver.y2]"))


def edited(tmp_path: Path, board: str, *edits: tuple[str, str]) -> Path:
    text = (BOARDS / f"{board}.toml").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "gantry.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("board", "row"), [(UART, "X(1, 1, 1, 2, 0, 1, 110, 0)"), (SPI, "X(2, 1, 1, 2, 0, 4, 50, 0)")])
def test_the_second_motor_of_an_axis_has_a_driver_of_its_own(tmp_path: Path, board: str, row: str) -> None:
    path = edited(tmp_path, board, *GANTRY)
    assert check_board(path) == []
    words = " ".join(pin_header_text(load_board(path)).split())
    assert words.partition("#define BOARD_DRIVER_ROWS(X) ")[2].partition("#define")[0].strip().endswith(row)


def test_a_driver_of_a_second_motor_that_is_missing_is_refused(tmp_path: Path) -> None:
    path = edited(tmp_path, UART, ("[driver.a]", "[driver.y2]"))
    said = "\n".join(str(problem) for problem in check_board(path))
    assert "the board has no second motor of y" in said
    assert "add [axis.y.second], or leave this out" in said


def test_a_second_motor_by_spi_has_a_select_line(tmp_path: Path) -> None:
    pins = (17, 16, 25, 21)
    selects = [(f"place = {n}", f'cs = {{ pin = "GPIO{pin}", active = "low" }}') for n, pin in enumerate(pins)]
    free = [
        (line, "")
        for line in ('spindle_pwm = "GPIO25"', 'coolant_mist = "GPIO21"', 'estop = { pin = "GPIO16", active = "high" }')
    ]
    path = edited(tmp_path, SPI, ('cs = { pin = "GPIO17", active = "low" }\n', ""), *free, *GANTRY, *selects)
    assert check_board(path) == []
    words = " ".join(pin_header_text(load_board(path)).split())
    assert "#define PIN_DRIVER_CS_Y2 25" in words
    assert "X(2, 1, 1, 0, 3, 1, 50, 0)" in words, "the fourth select line"


@pytest.mark.parametrize("table", ["[driver_bus]", "[driver.x]"])
def test_an_output_of_a_shift_register_selects_no_driver(tmp_path: Path, table: str) -> None:
    """The registers are clocked for steps, the SPI controller switches its select lines itself, with each transfer."""
    text = (BOARDS / "six-pack.toml").read_text(encoding="utf-8")
    bus = '[driver_bus]\nspi = "SPI3"\nmosi = "GPIO23"\nmiso = "GPIO19"\nsclk = "GPIO18"\n'
    cs = 'cs = { pin = "I2SO.23", active = "low" }\n'
    driver = '[driver.x]\nkind = "tmc2130"\n'
    text += f"\n{bus}{cs}{driver}place = 0\n" if table == "[driver_bus]" else f"\n{bus}{driver}{cs}"
    path = tmp_path / "shifted.toml"
    path.write_text(text, encoding="utf-8")
    said = "\n".join(str(problem) for problem in check_board(path))
    assert "I2SO.23 changes with a word of the step engine only" in said
    assert "needs a pin of the chip" in said
