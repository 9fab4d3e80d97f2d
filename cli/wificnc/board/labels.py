"""The words of a board for people: what a signal is called, and one row per wired pin for tables and pictures."""

from __future__ import annotations

from dataclasses import dataclass

from wificnc.board.chip import ChipPin
from wificnc.board.model import AXIS_LETTERS, Board, Role, Use
from wificnc.tables import load_settings

_AXIS_WORDS = {"step": "step", "dir": "direction", "enable": "enable", "limit": "limit", "home": "home"}
_WORDS = {
    "enable": "motor enable",
    "spindle_enable": "spindle on",
    "spindle_pwm": "spindle PWM",
    "spindle_dir": "spindle direction",
    "coolant_flood": "flood coolant",
    "coolant_mist": "mist coolant",
    "charge_pump": "charge pump",
    "servo": "RC servo",
    "estop": "e-stop",
    "encoder_a": "encoder A",
    "encoder_b": "encoder B",
    "encoder_index": "encoder index",
    "eth_mosi": "Ethernet MOSI",
    "eth_miso": "Ethernet MISO",
    "eth_sclk": "Ethernet SCLK",
    "eth_int": "Ethernet INT",
    "eth_cs": "Ethernet CS",
    "serial_tx": "console TX",
    "serial_rx": "console RX",
    "i2so_bck": "shift clock",
    "i2so_data": "shift data",
    "i2so_ws": "shift latch",
    "bus_tx": "RS-485 TX",
    "bus_rx": "RS-485 RX",
    "bus_de": "RS-485 driver enable",
    "pendant_tx": "to the pendant",
    "pendant_rx": "from the pendant",
    "dial_a": "dial A",
    "dial_b": "dial B",
    "dial_x10": "dial step x10",
    "dial_x100": "dial step x100",
    **{f"dial_axis_{letter.lower()}": f"dial axis {letter}" for letter in AXIS_LETTERS},
    "driver_tx": "Drivers UART TX",
    "driver_rx": "Drivers UART RX",
    "driver_mosi": "Drivers SPI MOSI",
    "driver_miso": "Drivers SPI MISO",
    "driver_sclk": "Drivers SPI clock",
    "driver_cs": "Drivers SPI select",
    "led": "status LED",
}
SECOND_PULL_OFF = load_settings()["second_pull_off_mm"].number  # of X
_BUSES = (Role.ETHERNET, Role.SERIAL, Role.I2SO, Role.SPINDLE_BUS, Role.PENDANT, Role.DRIVER_BUS, Role.LED)


@dataclass(frozen=True)
class PinRow:
    """One wired pin in words."""

    signal: str
    label: str
    pin: str
    direction: str
    active: str
    pull: str
    remarks: tuple[str, ...]
    allow: dict[str, str]


def label(signal: str) -> str:
    """step_x -> X step, misc_out_0 -> output 0"""
    if signal in _WORDS:
        return _WORDS[signal]
    kind, *rest = signal.split("_")
    if kind == "misc":
        return f"{rest[0]}put {rest[1]}"
    if kind in _AXIS_WORDS and rest:
        return " ".join([rest[0].upper(), _AXIS_WORDS[kind], *rest[1:]])
    return signal.replace("_", " ")


def remarks(pin: ChipPin) -> tuple[str, ...]:
    """What else the pin is, in a word or two each."""
    shared = [pin.usb, pin.console, pin.debug]
    return tuple(word for word in (*shared, "strapping" if pin.strap else None, pin.adc) if word)


def pin_rows(board: Board) -> list[PinRow]:
    """The wired pins in the order of the signals."""
    return [_row(board, use) for use in board.uses()]


def spare_drivers_text(board: Board) -> str:
    """Whose drivers $210 .. can make second motors; empty: no one's."""
    letters = [letter for n, letter in enumerate(board.axes) if n > 0 and not board.ganged_axes >> n & 1]
    words = [f"{letter} ({_switch_word(board, letter)})" for letter in letters]
    return f"drivers that can be second motors by $210 ..: {', '.join(words)}" if words else ""


def _switch_word(board: Board, letter: str) -> str:
    at = AXIS_LETTERS.index(letter)
    kind = "home switch" if board.home_axes >> at & 1 else "limit"
    return f"no {kind}: one switch for both motors" if board.switchless >> at & 1 else f"with its {kind}"


def notes(board: Board) -> list[str]:
    """What to know before wiring: of the board, then of the pins it uses."""
    pins = board.pins.pin
    one_switch = [
        f"{letter} has two motors and one switch: both stop at it. Homing squares the gantry by the difference of $27 "
        f"and ${SECOND_PULL_OFF + AXIS_LETTERS.index(letter)} only, and does not notice what it lost without power."
        for letter in board.one_switch
    ]
    return [
        *board.note,
        *one_switch,
        *(f"{use.pin} is {pins[use.pin].note}." for use in board.uses() if pins[use.pin].note),
    ]


def _row(board: Board, use: Use) -> PinRow:
    is_bus = use.role in _BUSES
    return PinRow(
        signal=use.signal,
        label=label(use.signal),
        pin=use.pin,
        direction="out" if use.is_output else "in",
        active="" if is_bus else use.active,
        pull="" if is_bus or use.is_output or use.pull == "none" else use.pull,
        remarks=remarks(board.pins.pin[use.pin]),
        allow=dict(use.wire.allow),
    )
