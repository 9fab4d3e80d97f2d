"""Motor drivers with registers in configurations of FluidNC."""

from __future__ import annotations

from pathlib import Path

import pytest
from driver_grbl import TMC2130, TMC2209, TMC5160, DriverGrbl
from wificnc.board.fluidnc.convert import import_fluidnc
from wificnc.board.fluidnc.remarks import Kind
from wificnc.board.load import check_board
from wificnc.files.problem import FileProblems
from wificnc.profile import load_machine

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
        ("tmc_2209", UART, ("uart_num: 1; addr: 1", "uart_num: 1; addr: 1"), "has address 1, too"),
        ("tmc_2209", UART, ("uart_num: 1; addr: 1", "uart_num: 2; addr: 1"), "it is on uart2"),
        ("tmc_2209", UART, ("uart_num: 1; addr: 4",), "no address 4"),
        ("tmc_2209", "", ("uart_num: 1; addr: 1",), "no uart1 with txd_pin"),
        ("tmc_2209", UART, ("uart_num: 1; addr: 3; cs_pin: gpio.21",), "GPIO21 selects it on the UART"),
        ("tmc_2209", UART, ("uart_num: 1; addr: 3; cs_pin: i2so.14",), "I2SO.14 selects it on the UART"),
        ("tmc_2208", UART, ("uart_num: 1",), "registers of a TMC2208 are not supported"),
    ],
)
def test_a_driver_that_cannot_be_reached_runs_by_its_pins_with_the_reason(
    tmp_path: Path, kind: str, bus: str, more: tuple[str, ...], why: str
) -> None:
    path = config(tmp_path, kind, bus, *more)
    imported = import_fluidnc(path)
    assert why in losses(path)
    assert "it runs with the current that VREF and the sense resistors set" in losses(path)
    assert not imported.refused
    assert "step" in imported.board["axis"]["x"]


@pytest.mark.parametrize(("address", "by_pins"), [(0, 8), (1, 32), (2, 64), (3, 16)])
def test_steps_of_a_driver_by_its_pins_are_those_of_its_address(tmp_path: Path, address: int, by_pins: int) -> None:
    """Table of MS1, MS2 in the TMC2209's data sheet; the configuration has 32."""
    said = losses(config(tmp_path, "tmc_2209", "", f"uart_num: 1; addr: {address}"))
    assert f"(address {address}: {by_pins}); the configuration has 32" in said
    assert (f"multiply steps/mm of X by {by_pins / 32:g}" in said) == (by_pins != 32)


@pytest.mark.parametrize(
    ("kind", "more", "why"),
    [
        ("tmc_5160", ("cs_pin: i2so.3", "cs_pin: i2so.6"), "is I2SO.3, an output of a shift register"),
        ("tmc_2130", ("cs_pin: i2so.3", "cs_pin: gpio.5"), "is I2SO.3, an output of a shift register"),
        ("tmc_5160", ("spi_index: 1",), "no driver of the chain has a cs_pin"),
        ("tmc_5160", ("cs_pin: i2so.3; spi_index: 1", "spi_index: 2"), "the chain's cs_pin is I2SO.3"),
        ("tmc_5160", ("cs_pin: gpio.17; spi_index: 1", "spi_index: 3"), "the chain has spi_index 1, 3"),
        ("tmc_5160", ("cs_pin: gpio.17; spi_index: 1", "spi_index: 1"), "the chain has spi_index 1, 1"),
        ("tmc_2130", ("cs_pin: gpio.5", ""), "axes.y.motor0.tmc_2130 has no cs_pin"),
        ("tmc_2160", ("cs_pin: gpio.5",), "registers of a TMC2160 are not supported"),
        ("tmc_5160pro", ("cs_pin: gpio.5",), "registers of a TMC5160PRO are not supported"),
    ],
)
def test_an_axis_whose_driver_stays_off_is_not_imported(
    tmp_path: Path, kind: str, more: tuple[str, ...], why: str
) -> None:
    """TOFF is 0 after power-on: no motor would turn while the position counts."""
    with pytest.raises(FileProblems) as caught:
        import_fluidnc(config(tmp_path, kind, SPI, *more))
    said = str(caught.value)
    assert why in said and "outputs are off (TOFF = 0): X is left out" in said
    assert "runs" not in said and "name it stepstick" in said


def test_an_axis_behind_one_that_stays_off_is_left_out(tmp_path: Path) -> None:
    path = config(tmp_path, "tmc_2209", UART, "uart_num: 1; addr: 0", "uart_num: 1; addr: 1", "uart_num: 1; addr: 2")
    text = path.read_text(encoding="utf-8").split("tmc_2209")
    path.write_text("tmc_2209".join(text[:2]) + "tmc_2130" + "tmc_2209".join(text[2:]), encoding="utf-8")
    imported = import_fluidnc(path)
    assert not imported.refused and list(imported.board["axis"]) == list(imported.board["driver"]) == ["x"]
    assert "drivers with registers are on one bus" in losses(path) and "Z follows an axis" in losses(path)


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


def test_homing_of_a_driver_without_its_registers_is_not_promised(tmp_path: Path) -> None:
    assert "StallGuard" not in losses(config(tmp_path, "tmc_2209", "", "uart_num: 1; addr: 0; homing_mode: StallGuard"))


FIRST = "tmc_2209; addr: 1; uart_num: 1"


def gantry(folder: Path, second: str, first: str = FIRST, bus: str = UART) -> Path:
    """Y has two motors. @param second  section of the driver, and what differs from the usual"""
    usual = {"r_sense_ohms": "0.110", "run_amps": "1.200", "hold_amps": "0.600", "microsteps": "32",
             "run_mode": "CoolStep"}  # fmt: skip
    text = f"board: Test\nstepping:\n  engine: RMT\n{bus}axes:\n"
    pins = iter(((12, 14), (27, 26), (32, 33)))
    for axis, motors in (
        ("x", [first.replace("addr: 1", "addr: 0").replace("gpio.21", "gpio.22")]),
        ("y", [first, second]),
    ):
        text += f"  {axis}:\n    steps_per_mm: 200\n"
        for number, motor in enumerate(motors):
            kind, *more = motor.split("; ")
            step, direction = next(pins)
            keys = {"step_pin": f"gpio.{step}", "direction_pin": f"gpio.{direction}"}
            keys |= usual if kind.startswith("tmc_") else {}
            keys |= dict(key.split(": ") for key in more)
            lines = "".join(f"        {key}: {value}\n" for key, value in keys.items())
            text += f"    motor{number}:\n      {kind}:\n{lines}"
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_driver_of_a_second_motor_has_a_table_of_its_own(tmp_path: Path) -> None:
    imported = import_fluidnc(gantry(tmp_path, "tmc_2209; addr: 3; uart_num: 1; r_sense_ohms: 0.220"))
    assert not imported.refused
    assert "registers" not in "\n".join(imported.remarks.lines(Kind.LOST))
    assert imported.board["driver"]["y2"] == {"kind": "tmc2209", "address": 3, "sense_mohm": 220}
    board = tmp_path / "mine.toml"
    board.write_text(imported.board_text("config.yaml"), encoding="utf-8")
    assert check_board(board) == []


@pytest.mark.parametrize(
    ("first", "second", "current_ma"),
    [("1.200", "0.800", 800), ("0.800", "1.200", 800), ("1.900", "1.900; r_sense_ohms: 0.220", 957)],
)
def test_two_motors_with_different_currents_get_the_smaller(
    tmp_path: Path, first: str, second: str, current_ma: int
) -> None:
    """Also where a sense resistor allows less than the other."""
    path = gantry(tmp_path, f"tmc_2209; addr: 3; uart_num: 1; run_amps: {second}", f"{FIRST}; run_amps: {first}")
    imported = import_fluidnc(path)
    assert imported.machine["axis"]["y"]["driver_current_ma"] == current_ma
    (line,) = [line for line in imported.remarks.lines(Kind.CHANGED) if "smaller current" in line]
    assert "driver_current_ma" in line and f"{current_ma} mA" in line


S8, CS5, CS21 = "stepstick", "tmc_5160; cs_pin: gpio.5", "tmc_5160; cs_pin: gpio.21"


@pytest.mark.parametrize(
    ("bus", "first", "second", "why"),
    [
        # the Jackpot's: the other three sockets share an address, and a selector chooses among them
        (UART, FIRST, "tmc_2209; addr: 3; uart_num: 1; cs_pin: i2so.14", "16 microsteps by its pins, as I2SO.14"),
        (UART, "tmc_2209; addr: 3; uart_num: 1; cs_pin: i2so.14", FIRST, "16 microsteps by its pins, as I2SO.14"),
        (UART, FIRST, "tmc_2209; addr: 2; uart_num: 2", "64 microsteps by its pins, as it is on uart2"),
        (UART, FIRST, "tmc_2209; addr: 0; uart_num: 1", "address 0, too"),  # X has it
        (UART, FIRST, "tmc_2209; addr: 3; uart_num: 1; microsteps: 16", "16 microsteps and its current by its reg"),
        (UART, FIRST, "tmc_2208; uart_num: 1", "TMC2208 are not supported"),
        (UART, FIRST, CS5, "stays off"),
        (UART, FIRST, S8, "by its pins and jumpers"),
        (UART, S8, FIRST, "by its pins and jumpers"),
        (UART, S8, "tmc_2208; uart_num: 1", "TMC2208 are not supported"),
        ("", FIRST, "tmc_2209; addr: 3; uart_num: 1", "32 microsteps by its pins"),  # neither is written: 32 and 16
        ("", FIRST, "tmc_2209; addr: 1; uart_num: 1; r_sense_ohms: 0.220", "32 microsteps by its pins"),
        ("", FIRST, "tmc_2209; addr: 1; uart_num: 1; microsteps: 16", "32 microsteps by its pins"),
        (SPI, CS21, "tmc_2209; addr: 3; uart_num: 1", "on one bus"),
        (SPI, CS21, S8, "by its pins and jumpers"),
        (SPI, S8, "tmc_5160; cs_pin: i2so.3", "stays off"),
        ("", S8, f"{S8}; ms1_pin: gpio.4", "ms1_pin of which no output"),
        ("", S8, "solenoid; output_pin: gpio.2", "cannot be driven here"),
        ("", "unipolar; pin0: gpio.2", S8, "cannot be driven here"),
        ("", S8, f"{S8}; step_pin: uart_channel1.3", "cannot be driven here"),
    ],
)
def test_motors_of_an_axis_that_would_part_are_refused_and_nothing_is_written(
    tmp_path: Path, bus: str, first: str, second: str, why: str
) -> None:
    path = gantry(tmp_path, second, first, bus)
    if "unipolar" in first:
        path.write_text(path.read_text(encoding="utf-8").replace("unipolar:", "stepstick:", 1), encoding="utf-8")
    with pytest.raises(FileProblems) as caught:
        import_fluidnc(path)
    said = str(caught.value)
    assert why in said and "the two motors of Y would not move alike" in said and "nothing was written" in said
    assert caught.value.problems[0].rule == "gantry"


@pytest.mark.parametrize(
    ("bus", "first", "second"),
    [
        (UART, FIRST, "tmc_2209; addr: 3; uart_num: 1"),
        (UART, FIRST, "tmc_2209; addr: 3; uart_num: 1; run_mode: StealthChop"),
        ("", FIRST, FIRST),
        ("", "tmc_2208; uart_num: 1", "tmc_2208; uart_num: 1"),
        ("", S8, S8),
        ("", S8, "standard_stepper"),
        ("", f"{S8}; ms1_pin: gpio.4", f"{S8}; ms1_pin: gpio.5"),
        (SPI, CS21, CS5),
        ("", S8, "null_motor"),
    ],
)
def test_motors_of_an_axis_that_stay_together_are_taken(tmp_path: Path, bus: str, first: str, second: str) -> None:
    """The same source of microsteps and current, whichever it is; or there is one motor only."""
    imported = import_fluidnc(gantry(tmp_path, second, first, bus))
    assert not imported.refused
    drivers = imported.board.get("driver", {})
    assert ("y" in drivers) == ("y2" in drivers)
    assert ("second" in imported.board["axis"]["y"]) == (second != "null_motor")
