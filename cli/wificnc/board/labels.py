"""The words of a board for people: what a signal is called, and one row per wired pin for tables and pictures."""

from __future__ import annotations

from dataclasses import dataclass

from wificnc.board.chip import ChipPin
from wificnc.board.model import Board, Role, Use

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
    "led": "status LED",
}
_BUSES = (Role.ETHERNET, Role.SERIAL, Role.I2SO, Role.LED)


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


def notes(board: Board) -> list[str]:
    """What to know before wiring: of the board, then of the pins it uses."""
    pins = board.pins.pin
    return [*board.note, *(f"{use.pin} is {pins[use.pin].note}." for use in board.uses() if pins[use.pin].note)]


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
