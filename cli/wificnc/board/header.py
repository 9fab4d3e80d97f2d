"""pin_config.h of a board: what the firmware must know of the wiring at compile time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from wificnc.board.chip import is_shifted
from wificnc.board.model import AXES_MAX, AXIS_LETTERS, MISC_IN_MAX, MISC_OUT_MAX, Board, Role, Use
from wificnc.board.pin_keys import PinKey, pin_keys
from wificnc.board.rules import NS_PER_S, is_reachable, step_spread_ns
from wificnc.board.shift_registers import pulse_engine, step_grid_ns

if TYPE_CHECKING:
    from jinja2 import Template

NAME_COLUMN = 26
LED_KINDS = {"plain": "BOARD_LED_PLAIN", "ws2812": "BOARD_LED_WS2812"}
NUMBERING = {
    "esp32": "GPIO number",
    "pic32mz": "16 * port (A = 0) + bit",
    "host": "number of the virtual pin",
}

# Every signal a board can have, in the order of the header; tests compare it with what the model can wire.
AXIS_SIGNALS = ("step_{}", "dir_{}", "enable_{}", "limit_{}", "limit_{}_min", "limit_{}_max", "home_{}")
SECOND_SIGNALS = tuple(pattern.replace("{}", "{}2") for pattern in AXIS_SIGNALS)  # of an axis' second motor
OUTPUT_SIGNALS = (
    "enable",
    "spindle_enable",
    "spindle_pwm",
    "spindle_dir",
    "coolant_flood",
    "coolant_mist",
    "charge_pump",
    "servo",
    "led",
)
INPUT_SIGNALS = ("probe", "toolsetter", "estop", "encoder_a", "encoder_b", "encoder_index")
BUS_SIGNALS = (
    *("eth_mosi", "eth_miso", "eth_sclk", "eth_int", "eth_cs"),
    *("serial_tx", "serial_rx"),
    *("i2so_bck", "i2so_data", "i2so_ws"),
    *("bus_tx", "bus_rx", "bus_de"),
    *("pendant_tx", "pendant_rx"),
    *("dial_a", "dial_b", "dial_x10", "dial_x100"),
    *(f"dial_axis_{letter}" for letter in AXIS_LETTERS.lower()),
    *("driver_tx", "driver_rx", "driver_mosi", "driver_miso", "driver_sclk", "driver_cs"),
    *(f"driver_cs_{letter}{motor}" for motor in ("", "2") for letter in AXIS_LETTERS.lower()),
)
DIAL_SIGNALS = tuple(signal for signal in BUS_SIGNALS if signal.startswith("dial_"))
# Pins that nothing moves and no table lists: they cost no memory of the firmware.
FIXED_SIGNALS = tuple(signal for signal in BUS_SIGNALS if signal.startswith(("driver_", "dial_")))
BUSES = (Role.ETHERNET, Role.SERIAL, Role.I2SO, Role.SPINDLE_BUS, Role.PENDANT, Role.DIAL, Role.DRIVER_BUS)


@dataclass(frozen=True)
class Define:
    """One #define."""

    name: str
    value: str
    comment: str | None = None


@dataclass(frozen=True)
class PinTable:
    """An X-macro over the wired pins."""

    name: str
    rows: tuple[str, ...]


def pin_header_text(board: Board) -> str:
    """The whole header. Same board file and pin table, same text."""
    return _template().render(
        board=board,
        axes_max=AXES_MAX,
        ticks=_ticks(board),
        step_engine=pulse_engine(board),
        step_spread_ns=step_spread_ns(board),
        step_grid_ns=step_grid_ns(board),
        numbering=NUMBERING[board.target],
        groups=[[_pin(board, signal) for signal in group] for group in signal_groups()],
        signals=[[_signal(signal) for signal in group if signal not in FIXED_SIGNALS] for group in signal_groups()],
        arrays=list(_arrays()),
        movable=list(_movable(board)),
        tables=_tables(board),
        masks=list(_masks(board)),
        led_kind=LED_KINDS[board.led.kind] if board.led else "BOARD_LED_NONE",
        driver_rows=" ".join(f"X({', '.join(map(str, row))})" for row in board.driver_rows),
        dial_rows=" ".join(f"X({_dial_row(board, signal)})" for signal in DIAL_SIGNALS),
        pin_keys=[_pin_key_row(row) for row in pin_keys(board)],
    )


def write_if_changed(path: Path, text: str) -> bool:
    """Write the file unless it already says this, so that nothing is rebuilt for nothing. True = written."""
    if path.is_file() and path.read_bytes() == text.encode():
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text.encode())
    return True


def signal_groups() -> list[list[str]]:
    """Every signal a board can have, in groups."""
    letters = AXIS_LETTERS.lower()
    return [
        *([pattern.format(letter) for letter in letters] for pattern in AXIS_SIGNALS + SECOND_SIGNALS),
        list(OUTPUT_SIGNALS),
        [f"misc_out_{index}" for index in range(MISC_OUT_MAX)],
        list(INPUT_SIGNALS),
        [f"misc_in_{index}" for index in range(MISC_IN_MAX)],
        list(BUS_SIGNALS),
    ]


@cache
def _template() -> Template:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # few of those who need a board write a header

    env = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    env.globals["define"] = _define
    env.filters["quoted"] = _quoted
    return env.get_template("pin_config.h.j2")


def _define(name: str, value: object, comment: str | None = None) -> str:
    return f"#define {name:<{NAME_COLUMN}} {value}" + (f" /* {comment} */" if comment else "")


def _quoted(text: str) -> str:
    """A C string literal: JSON's escapes are C's."""
    return json.dumps(text, ensure_ascii=False)


def _ticks(board: Board) -> dict[str, int]:
    timing = board.timing
    return {
        "step_pulse": timing.step_pulse_ns * timing.timer_hz // NS_PER_S,
        "dir_setup": timing.dir_setup_ns * timing.timer_hz // NS_PER_S,
        "min_period": timing.timer_hz // timing.max_step_rate_hz,
    }


def _macro(signal: str) -> str:
    return f"PIN_{signal.upper()}"


def _signal(signal: str) -> str:
    return f"SIGNAL_{signal.upper()}"


def _pin(board: Board, signal: str) -> Define:
    pin = board.pin_names().get(signal)
    return Define(_macro(signal), f"{board.pins.pin[pin].number}u" if pin else "PIN_NONE", pin)


def _arrays() -> Iterator[Define]:
    groups = signal_groups()
    for pattern, signals in zip(AXIS_SIGNALS + SECOND_SIGNALS, groups, strict=False):
        name = pattern.replace("_{}2", "_second").replace("_{}", "").upper()
        yield _array(f"BOARD_{name}_PINS", [_macro(signal) for signal in signals])
    yield _array("BOARD_MISC_OUT_PINS", [_macro(f"misc_out_{index}") for index in range(MISC_OUT_MAX)])
    yield _array("BOARD_MISC_IN_PINS", [_macro(f"misc_in_{index}") for index in range(MISC_IN_MAX)])


def _movable(board: Board) -> Iterator[Define]:
    """The pins to which signals can be moved at run time."""
    for kind in ("output", "input"):
        pins = [f"{pin.number}u" for name, pin in board.pins.pin.items() if is_movable_to(board, name, kind)]
        yield _array(f"BOARD_FREE_{kind.upper()}_PINS", pins)


def is_movable_to(board: Board, name: str, kind: str) -> bool:
    """Whether the firmware of this board lets a signal be moved to this pin; kind: "output" or "input"."""
    return bool(getattr(board.pins.pin[name], kind)) and _is_free(board, name)


def _is_free(board: Board, name: str) -> bool:
    """Neither a bus of the board nor the chip itself needs the pin; what the board wires there it has answered for."""
    use, pin = board.use_of(name), board.pins.pin[name]
    if is_shifted(name):
        return False  # soldered to what it drives
    if use is not None:
        return use.role not in BUSES
    is_needed = pin.taken_in(board.memory.mode) or pin.strap or pin.usb or pin.console
    return not is_needed and is_reachable(board, name)


def _pin_key_row(row: PinKey) -> str:
    return f"{_macro(row.signal)}, {_signal(row.signal)}, 0x{row.legal:X}ull"


def _array(name: str, items: list[str]) -> Define:
    return Define(name, "{" + ", ".join(items) + "}")


def _tables(board: Board) -> list[PinTable]:
    uses = [use for use in board.uses() if use.role not in BUSES]
    outputs = tuple(_output_row(use) for use in uses if use.is_output)
    inputs = tuple(_input_row(use) for use in uses if not use.is_output)
    return [PinTable("BOARD_OUTPUTS", outputs), PinTable("BOARD_INPUTS", inputs)]


def _output_row(use: Use) -> str:
    return f"{_macro(use.signal)}, {_signal(use.signal)}, {int(use.active == 'high')}"


def _input_row(use: Use) -> str:
    return f"{_output_row(use)}, PIN_PULL_{use.pull.upper()}"


def _dial_row(board: Board, signal: str) -> str:
    """Pin, level that switches on, pull; not wired: no pin."""
    use = next((use for use in board.uses() if use.signal == signal), None)
    return f"{_macro(signal)}, {int(use.active == 'high')}, PIN_PULL_{use.pull.upper()}" if use else "PIN_NONE, 0, 0"


def _masks(board: Board) -> Iterator[Define]:
    for kind in ("step", "dir"):
        names = [f"BOARD_{kind.upper()}_MASK_{bank}" for bank in range(len(board.pins.fast.banks))]
        for bank, register in enumerate(board.pins.fast.banks):
            yield Define(names[bank], f"0x{_mask(board, kind, bank):08X}u", register)
        yield _array(f"BOARD_{kind.upper()}_MASKS", names)


def _mask(board: Board, kind: str, bank: int) -> int:
    pins = [getattr(motor, kind).pin for motor in board.axis.motors().values()]
    bits = (board.pins.pin[pin].number % board.pins.fast.bank_width for pin in pins if board.pins.bank(pin) == bank)
    return sum(1 << bit for bit in bits)
