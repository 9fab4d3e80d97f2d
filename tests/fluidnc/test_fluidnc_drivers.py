"""Motor drivers with registers in configurations of FluidNC."""

from __future__ import annotations

from pathlib import Path

import pytest
from driver_grbl import TMC2130, TMC2209, TMC5160, DriverGrbl
from wificnc.board.load import check_board
from wificnc.fluidnc.convert import import_fluidnc
from wificnc.fluidnc.remarks import Kind
from wificnc.machine import load_machine

MOTOR = """
  {axis}:
    steps_per_mm: 200
    max_rate_mm_per_min: 3000
    acceleration_mm_per_sec2: 200
    max_travel_mm: 300
    motor0:
      {kind}:
        step_pin: gpio.{step}
        direction_pin: gpio.{dir}
        r_sense_ohms: 0.110
        run_amps: 1.200
        hold_amps: 0.600
        microsteps: 32
        run_mode: {mode}
{more}"""
STEPS = {"x": (12, 14), "y": (27, 26), "z": (32, 33)}
UART = "uart1:\n  txd_pin: gpio.17\n  rxd_pin: gpio.16\n  baud: 115200\n  mode: 8N1\n"
SPI = "spi:\n  miso_pin: gpio.19\n  mosi_pin: gpio.23\n  sck_pin: gpio.18\n"


def config(folder: Path, kind: str, bus: str, *more: str, mode: str = "CoolStep") -> Path:
    text = f"board: Test\nname: Test\nstepping:\n  engine: RMT\n{bus}axes:"
    for (axis, (step, direction)), extra in zip(STEPS.items(), more, strict=False):
        lines = "".join(f"        {line}\n" for line in extra.split("; "))
        text += MOTOR.format(axis=axis, kind=kind, step=step, dir=direction, more=lines, mode=mode)
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def losses(path: Path) -> str:
    return "\n".join(import_fluidnc(path).remarks.lines(Kind.LOST))


def test_tmc2209_on_a_uart_get_bus_address_and_settings(tmp_path: Path) -> None:
    path = config(tmp_path, "tmc_2209", UART, "uart_num: 1; addr: 0", "uart_num: 1; addr: 2", mode="StealthChop")
    imported = import_fluidnc(path)
    assert not imported.refused
    assert "registers" not in losses(path)
    board = tmp_path / "mine.toml"
    board.write_text(imported.board_text("config.yaml"), encoding="utf-8")
    assert check_board(board) == []
    assert imported.board["driver"]["y"] == {"kind": "tmc2209", "address": 2, "sense_mohm": 110}
    profile = tmp_path / "machine.toml"
    profile.write_text(imported.machine_text("config.yaml"), encoding="utf-8")
    settings = load_machine(profile).settings()
    assert [settings[number] for number in (140, 150, 220, 230, 141)] == [1200, 32, 50, 65535, 1200]


@pytest.mark.parametrize("chained", [True, False])
def test_spi_drivers_get_a_chain_or_selects_of_their_own(tmp_path: Path, chained: bool) -> None:
    # FluidNC refuses a chain whose cs_pin is there more than once.
    more = (
        ["cs_pin: gpio.17; spi_index: 1", "spi_index: 2", "spi_index: 3"]
        if chained
        else [f"cs_pin: gpio.{n}" for n in (17, 21, 22)]
    )
    path = config(tmp_path, "tmc_5160", SPI, *more)
    imported = import_fluidnc(path)
    assert not imported.refused
    assert "registers" not in losses(path)
    assert ("cs" in imported.board["driver_bus"]) == chained
    assert [driver.get("place") for driver in imported.board["driver"].values()] == (
        [0, 1, 2] if chained else [None] * 3
    )


@pytest.mark.parametrize(
    ("kind", "bus", "more", "why"),
    [
        ("tmc_2209", UART, ("uart_num: 1; addr: 1", "uart_num: 1; addr: 1"), "address 1 is another driver's"),
        ("tmc_2209", "", ("uart_num: 1; addr: 1",), "has no txd_pin"),
        ("tmc_2209", UART, ("uart_num: 1; addr: 3; cs_pin: gpio.21",), "a pin selects it on the UART"),
        ("tmc_5160", SPI, ("spi_index: 1",), "its cs_pin is"),
        ("tmc_5160", SPI, ("cs_pin: gpio.17; spi_index: 1", "cs_pin: gpio.17; spi_index: 3"), "the chain has drivers"),
        ("tmc_2208", UART, ("uart_num: 1",), "registers"),
    ],
)
def test_what_cannot_be_reached_is_a_plain_driver_with_the_reason(
    tmp_path: Path, kind: str, bus: str, more: tuple[str, ...], why: str
) -> None:
    path = config(tmp_path, kind, bus, *more)
    imported = import_fluidnc(path)
    assert why in losses(path)
    assert not imported.refused
    assert "step" in imported.board["axis"]["x"]


def test_the_last_of_a_chain_may_have_its_select_line(tmp_path: Path) -> None:
    path = config(tmp_path, "tmc_5160", SPI, "spi_index: 3", "spi_index: 2", "cs_pin: gpio.17; spi_index: 1")
    imported = import_fluidnc(path)
    assert imported.board["driver_bus"]["cs"] == {"pin": "GPIO17", "active": "low"}
    assert [driver["place"] for driver in imported.board["driver"].values()] == [2, 1, 0]


@pytest.mark.parametrize(("kind", "number"), [("tmc_5160", TMC5160), ("tmc_2130", TMC2130), ("tmc_2209", TMC2209)])
def test_a_current_above_that_of_the_sense_resistor_is_cut_off(tmp_path: Path, kind: str, number: int) -> None:
    more = "uart_num: 1; addr: 0" if kind == "tmc_2209" else "cs_pin: gpio.5"
    path = config(tmp_path, kind, UART if kind == "tmc_2209" else SPI, more)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("1.200", "4").replace("r_sense_ohms: 0.110", ""), encoding="utf-8")
    grbl = DriverGrbl(number)
    grbl.after(0.5)
    most_ma = int(grbl.rows()[0][5])
    imported = import_fluidnc(path)
    assert imported.machine["axis"]["x"]["driver_current_ma"] == most_ma
    assert "4000 mA: a sense resistor of" in "\n".join(imported.remarks.lines(Kind.CHANGED))


def test_homing_without_a_switch_and_with_a_current_of_its_own_are_named(tmp_path: Path) -> None:
    more = "uart_num: 1; addr: 0; homing_mode: StallGuard; homing_amps: 0.500"
    path = config(tmp_path, "tmc_2209", UART, more)
    assert "homing by StallGuard: wire DIAG" in losses(path)
    assert "0.5 A: an axis homes with" in "\n".join(import_fluidnc(path).remarks.lines(Kind.CHANGED))


def gantry(folder: Path, *, current: str = "1.200", addr: int = 3) -> Path:
    path = config(folder, "tmc_2209", UART, "uart_num: 1; addr: 0", "uart_num: 1; addr: 1")
    second = f"""    motor1:
      tmc_2209:
        step_pin: gpio.18
        direction_pin: gpio.19
        r_sense_ohms: 0.220
        run_amps: {current}
        hold_amps: 0.600
        microsteps: 32
        run_mode: CoolStep
        uart_num: 1
        addr: {addr}
"""
    path.write_text(path.read_text(encoding="utf-8") + second, encoding="utf-8")
    return path


def test_the_driver_of_a_second_motor_has_a_table_of_its_own(tmp_path: Path) -> None:
    imported = import_fluidnc(gantry(tmp_path))
    assert not imported.refused
    assert "registers" not in "\n".join(imported.remarks.lines(Kind.LOST))
    assert imported.board["driver"]["y2"] == {"kind": "tmc2209", "address": 3, "sense_mohm": 220}
    board = tmp_path / "mine.toml"
    board.write_text(imported.board_text("config.yaml"), encoding="utf-8")
    assert check_board(board) == []


def test_two_motors_with_different_currents_get_that_of_the_first(tmp_path: Path) -> None:
    imported = import_fluidnc(gantry(tmp_path, current="0.800"))
    assert imported.machine["axis"]["y"]["driver_current_ma"] == 1200
    (line,) = [line for line in imported.remarks.lines(Kind.CHANGED) if "tmc_2209" in line]
    assert "driver_current_ma" in line and "those of motor0" in line


def test_a_second_motor_at_the_address_of_another_is_a_plain_driver(tmp_path: Path) -> None:
    imported = import_fluidnc(gantry(tmp_path, addr=1))
    assert "y2" not in imported.board["driver"]
    assert "address 1 is another driver's" in "\n".join(imported.remarks.lines(Kind.LOST))
