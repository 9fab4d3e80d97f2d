"""The pins of a board by the keys of the binary protocol, and where each may be moved to.

The firmware has no rules of its own for pins: it looks into these masks, which the rules of boards have filled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

from wificnc.board.chip import is_shifted
from wificnc.board.model import AXIS_LETTERS, Board, Role, Use
from wificnc.board.rules import ALLOWABLE, pin_findings
from wificnc.board.wire import InputWire, OutputWire
from wificnc.connection.wmc3.keys import KEYS
from wificnc.tables.nvs import PIN_NONE, load_nvs

MASK_BITS = 64
# A reason for one of these is about the pin; a reason for the others is about the signal that is there.
OF_THE_PIN = frozenset(ALLOWABLE) - {"boot-level", "boot-glitch"}


@dataclass(frozen=True)
class PinKey:
    """A key with a pin: the signal whose pin it is on this board, and the pins that it may be moved to, as a mask."""

    key: int
    signal: str
    pin: int
    legal: int


def pin_keys(board: Board) -> tuple[PinKey, ...]:
    """Of every key with a pin, in the order of the keys."""
    uses = board.uses()
    return tuple(_pin_key(board, uses, key, signals) for key, signals in _signals())


@cache
def _signals() -> tuple[tuple[int, tuple[str, ...]], ...]:
    """Key -> its signals, with the letter of the axis or the number in place."""
    letters = AXIS_LETTERS.lower()
    return tuple(
        (
            row.key + n,
            tuple(signal.format(axis=letters[n] if row.count == len(letters) else "", n=n) for signal in row.signals),
        )
        for row in KEYS
        for n in range(row.count if row.kind == "pin" else 0)
    )


def _pin_key(board: Board, uses: Sequence[Use], key: int, signals: tuple[str, ...]) -> PinKey:
    wired = {use.signal: use for use in uses}
    signal = next((name for name in signals if name in wired), signals[0])
    pin = board.pins.pin[wired[signal].pin].number if signal in wired else PIN_NONE
    return PinKey(key, signal, pin, _legal(board, uses, key, signal))


def _legal(board: Board, uses: Sequence[Use], key: int, signal: str) -> int:
    """0: the board decides it."""
    use = next((use for use in uses if use.signal == signal), None)
    moved = {row.wire: row.signal for row in load_nvs().pin}
    if moved.get(key) != signal or board.target == "pic32mz" or _is_of_no_axis(board, signal):
        return 0
    if signal == "led" and board.led is None:
        return 0  # its kind is the board's
    if use is not None and is_shifted(use.pin) and use.role in (Role.STEP, Role.DIR):
        return 0
    use = use or unwired(signal)
    there = {each.pin: each for each in reversed(uses)}
    names = [
        name
        for name, pin in board.pins.pin.items()
        if pin.number < MASK_BITS and _may_be_at(board, use, name, there.get(name))
    ]
    return sum(1 << board.pins.pin[name].number for name in names)


def _is_of_no_axis(board: Board, signal: str) -> bool:
    kind, _, letter = signal.partition("_")
    return kind in ("step", "dir", "limit") and letter.upper() not in board.axes


def unwired(signal: str) -> Use:
    """With the usual levels (targets/esp32/io/pin_map.c)."""
    roles = {"limit": Role.LIMIT, "probe": Role.PROBE, "estop": Role.ESTOP}
    kinds = {"enable": Role.ENABLE, "spindle_enable": Role.SPINDLE, "charge_pump": Role.PUMP, "led": Role.LED}
    role = roles.get(signal.partition("_")[0])
    if role is not None:
        return Use(signal, (), role, InputWire(pin=""))
    return Use(signal, (), kinds.get(signal, Role.MISC), OutputWire(pin=""))


def _may_be_at(board: Board, use: Use, name: str, there: Use | None) -> bool:
    """@param there  what is wired at that pin"""
    if use.pin == name:
        return True
    if is_shifted(name) or (there is None and name in board.onboard) or (there is not None and not _can_go(there)):
        return False
    allowed = OF_THE_PIN & set(there.wire.allow) if there is not None else frozenset()
    wire = use.wire.model_copy(update={"pin": name, "allow": {}})
    return all(found.rule in allowed for found in pin_findings(board, board.pins, replace(use, wire=wire)))


@cache
def _movable_signals() -> frozenset[str]:
    return frozenset(row.signal for row in load_nvs().pin)


def _can_go(use: Use) -> bool:
    """The signal that is there can be moved away."""
    return use.signal in _movable_signals()
