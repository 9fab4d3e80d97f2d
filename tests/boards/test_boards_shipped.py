"""The boards we ship: they pass our rules, and differ from the published maps only where they say so."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from wificnc.board.chip import load_chips
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board, Role
from wificnc.files.problem import key_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PUBLISHED = tomllib.loads((Path(__file__).parent / "published.toml").read_text(encoding="utf-8"))
IDS = [path.stem for path in find_boards()]
BOARD_IDS = {
    "host-gantry",
    "esp32s3-zero",
    "esp32s3-devkitc",
    "esp32s3-devkitc-quad",
    "esp32-wroom32",
    "esp32-wroom32-router",
    "esp32-wroom32-laser",
    "esp32s3-devkitc-router",
    "esp32s3-devkitc-laser",
    "espduino32-cnc-shield",
    "fysetc-e4",
    "mks-dlc32-max",
    "xpro-v5",
    "mks-dlc32-v21",
    "mks-tinybee",
    "mks-tinybee-gantry",
    "six-pack",
    "jackpot",
    "jackpot3",
    "root-controller-iso",
    "root-controller-rev2",
    "pic32mz2048efh100",
    "host",
}
BOOT_RISKS = {"strapping", "boot-level", "boot-glitch"}
# Soldered so, or so by the shield: motors that hold without a step move nothing.
HOLD_AT_RESET = {"espduino32-cnc-shield"}


def wired(board: Board) -> dict[str, str]:
    return {key_text(use.path).removesuffix(".pin"): use.pin for use in board.uses()}


def test_the_promised_boards_are_there() -> None:
    assert set(IDS) >= BOARD_IDS


@pytest.mark.parametrize("board_id", IDS)
def test_board_passes_its_own_rules(board_id: str) -> None:
    board = load_board(board_id)
    assert board.id == board_id
    assert len(set(board.pin_names().values())) == len(board.uses())


@pytest.mark.parametrize("board_id", PUBLISHED)
def test_every_difference_from_the_published_map_is_a_deviation(board_id: str) -> None:
    board = load_board(board_id)
    ours, published = wired(board), PUBLISHED[board_id]
    differ = {key for key in ours.keys() | published.keys() if ours.get(key) != published.get(key)}
    declared = {item.key: item.published for item in board.deviation if not item.key.startswith("timing.")}
    assert declared == {key: published.get(key, "none") for key in differ}


def test_axes_timing_and_names_as_other_modules_read_them() -> None:
    board = load_board("esp32s3-zero")
    assert board.axes == ("X", "Y", "Z")
    assert (board.name, board.target, board.chip) == ("Waveshare ESP32-S3-Zero", "esp32", "esp32s3")
    assert (board.timing.timer_hz, board.timing.max_step_rate_hz) == (20_000_000, 250_000)
    names = board.pin_names()
    assert (names["step_x"], names["dir_z"], names["limit_y"], names["led"]) == ("GPIO1", "GPIO41", "GPIO6", "GPIO21")


@pytest.mark.parametrize(
    ("board_id", "timer_hz", "max_step_rate_hz", "axes"),
    [
        ("esp32s3-devkitc", 20_000_000, 250_000, "XYZABC"),
        ("esp32s3-devkitc-quad", 20_000_000, 250_000, "XYZABC"),
        ("esp32-wroom32", 20_000_000, 250_000, "XYZABC"),
        ("mks-dlc32-v21", 20_000_000, 240_000, "XYZ"),
        ("mks-tinybee", 20_000_000, 240_000, "XYZAB"),
        ("pic32mz2048efh100", 50_000_000, 300_000, "XYZA"),
        ("host", 20_000_000, 1_000_000, "XYZABC"),
    ],
)
def test_step_timing_of_the_targets(board_id: str, timer_hz: int, max_step_rate_hz: int, axes: str) -> None:
    board = load_board(board_id)
    assert (board.timing.timer_hz, board.timing.max_step_rate_hz) == (timer_hz, max_step_rate_hz)
    assert "".join(board.axes) == axes


def test_nothing_that_can_hurt_is_pulled_on_at_reset() -> None:
    for path in find_boards():
        board = load_board(path)
        for use in board.uses():
            if use.can_hurt and not (use.role is Role.ENABLE and board.id in HOLD_AT_RESET):
                assert board.pins.pin[use.pin].level_at_reset() != use.active, f"{board.id}: {use.signal}"


def test_spindle_and_coolant_take_no_boot_risk_at_all() -> None:
    for path in find_boards():
        for use in load_board(path).uses():
            if use.signal.startswith(("spindle", "coolant")):
                assert not BOOT_RISKS & use.wire.allow.keys()


@pytest.mark.parametrize("board_id", [board_id for board_id in IDS if load_board(board_id).target == "esp32"])
def test_every_esp32_board_has_a_laser_and_switches_something(board_id: str) -> None:
    output = load_board(board_id).output
    assert output.spindle_pwm is not None
    assert output.coolant_flood or output.coolant_mist or output.misc


def test_host_wires_every_kind_of_signal_but_the_buses() -> None:
    signals = set(load_board("host").pin_names())
    assert {
        "step_c",
        "limit_c_max",
        "spindle_dir",
        "coolant_mist",
        "charge_pump",
        "servo",
        "misc_out_4",
        "encoder_index",
    } <= signals


# Facts of the datasheets that boards rely on, written here a second time on purpose.


def test_esp32_pins_as_the_datasheet_has_them() -> None:
    chip = load_chips()["esp32", "esp32"]
    assert len(chip.pin) == 34
    input_only = {name for name, pin in chip.pin.items() if not pin.output}
    assert input_only == {f"GPIO{number}" for number in range(34, 40)}
    assert all(not chip.pin[name].pull_up and not chip.pin[name].pull_down for name in input_only)
    assert {name for name, pin in chip.pin.items() if pin.strap} == {"GPIO0", "GPIO2", "GPIO5", "GPIO12", "GPIO15"}
    assert chip.pin["GPIO12"].strap and chip.pin["GPIO12"].strap.at_boot == "low"
    assert {name for name in chip.pin if chip.pin[name].taken_in("flash")} == {f"GPIO{n}" for n in range(6, 12)}
    assert chip.pin["GPIO16"].taken_in("psram") and not chip.pin["GPIO16"].taken_in("flash")


def test_esp32s3_pins_as_the_datasheet_has_them() -> None:
    chip = load_chips()["esp32", "esp32s3"]
    assert len(chip.pin) == 45
    assert {name for name, pin in chip.pin.items() if pin.strap} == {"GPIO0", "GPIO3", "GPIO45", "GPIO46"}
    flash = {f"GPIO{n}" for n in range(26, 33)}
    assert {name for name in chip.pin if chip.pin[name].taken_in("quad")} == flash
    assert {name for name in chip.pin if chip.pin[name].taken_in("flash")} == flash - {"GPIO26"}
    octal = flash | {f"GPIO{n}" for n in range(33, 38)}
    assert {name for name in chip.pin if chip.pin[name].taken_in("octal")} == octal
    assert {name for name in chip.pin if chip.pin[name].taken_in("octal-1v8")} == octal | {"GPIO47", "GPIO48"}
    assert {name for name, pin in chip.pin.items() if pin.usb} == {"GPIO19", "GPIO20"}
    assert {name for name, pin in chip.pin.items() if pin.debug} == {f"GPIO{n}" for n in range(39, 43)}


def test_pic32mz_numbers_are_port_and_bit() -> None:
    chip = load_chips()["pic32mz", "pic32mz2048efh100"]
    for name, pin in chip.pin.items():
        assert pin.number == 16 * "ABCDEFG".index(name[1]) + int(name[2:])
    package = [pin.package_pin for pin in chip.pin.values()]
    assert len(package) == len(set(package)) == 78


@pytest.mark.parametrize("key", list(load_chips()))
def test_pin_numbers_are_unique_and_fit_a_byte(key: tuple[str, str]) -> None:
    numbers = [pin.number for pin in load_chips()[key].pin.values()]
    assert len(numbers) == len(set(numbers))
    assert all(0 <= number < 0xFF for number in numbers)


@pytest.mark.parametrize("board_id", IDS)
def test_ethernet_has_a_select_line(board_id: str) -> None:
    """Data sheet W5500, SPI Operation Mode: in the variable length mode, which ESP-IDF's driver uses alone, SCSn must
    be controlled by the host. With SCSn at ground the chip takes frames of 1, 2 or 4 bytes of data only."""
    ethernet = load_board(board_id).ethernet
    assert ethernet is None or ethernet.cs.pin
