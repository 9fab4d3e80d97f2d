"""Whether stored pins fit a board: the rules of board files, for signals that the storage moves to other pins."""

from __future__ import annotations

import re
from collections.abc import Sequence

from wificnc.board.chip import is_shifted, load_chips
from wificnc.board.model import Board, Use
from wificnc.board.pin_keys import PinKey, pin_keys, unwired
from wificnc.board.rules import pin_findings
from wificnc.errors import BoardError, FlashError
from wificnc.nvs.image import Entry
from wificnc.protocol.nvs import PIN_NONE, load_nvs

CHANNEL_PIN = re.compile(r"io_p\d+")  # of an I/O module
GPIO_COUNT = 64  # from here on: outputs of shift registers, no pin


def check_pins(board: Board, entries: Sequence[Entry]) -> None:
    """Raises BoardError: a pin that the board's firmware would refuse; all of them."""
    keys = {key.key: key for key in pin_keys(board)}
    signals = {row.key: (row.signal, keys[row.wire]) for row in load_nvs().pin}
    moves = {entry.key: int(entry.value) for entry in entries if entry.key in signals}
    places = {use.signal: board.pins.pin[use.pin].number for use in board.uses()}
    places |= {signals[key][0]: gpio for key, gpio in moves.items()}
    problems = []
    for key, gpio in moves.items():
        signal, pin_key = signals[key]
        reason = _misfit(board, signal, pin_key, gpio) or _rival(places, signal, gpio)
        if reason:
            problems.append(f"{key}={gpio}: {reason}")
    if problems:
        hint = f"`wificnc boards show {board.id}` shows its pins; leave the key out, and the signal stays where it is"
        raise BoardError("\n".join(problems), hint)


def check_chip_pins(chip: str, entries: Sequence[Entry]) -> None:
    """Raises FlashError: stored pins that no board with this chip has, so the image was made for another chip."""
    pins = load_chips().get(("esp32", chip))
    if pins is None:
        raise FlashError(f"WiFiCNC does not run on an {chip}; nothing was written")
    moved = {row.key for row in load_nvs().pin}
    by_number = {pin.number: pin for name, pin in pins.pin.items() if not is_shifted(name)}
    problems = []
    places = {
        entry.key: int(entry.value) for entry in entries if entry.key in moved or CHANNEL_PIN.fullmatch(entry.key)
    }
    for key, gpio in places.items():
        pin = by_number.get(gpio)
        if gpio < GPIO_COUNT and pin is None:
            problems.append(f"{key}={gpio}: the {pins.name} has no GPIO{gpio}")
        elif pin is not None and pin.taken and not pin.taken.memory:
            problems.append(f"{key}={gpio}: GPIO{gpio} of the {pins.name} is taken by {pin.taken.by}")
    if problems:
        raise FlashError(
            "\n".join([*problems, "the image is for another chip and was not written"]),
            hint="make it for this board: `wificnc nvs build MACHINE --board BOARD`",
        )


def _misfit(board: Board, signal: str, key: PinKey, gpio: int) -> str:
    """Why this signal cannot be there; "": it can."""
    if key.signal == signal and (gpio == key.pin or (gpio != PIN_NONE and gpio < 64 and key.legal >> gpio & 1)):
        return ""
    if key.signal != signal or key.legal == 0:
        return f"{signal} of {board.id} is fixed by the board, or not on it"
    if gpio == PIN_NONE:
        return ""
    name = next((name for name, pin in board.pins.pin.items() if pin.number == gpio and not is_shifted(name)), None)
    if name is None:
        return f"the {board.pins.name} has no GPIO{gpio}"
    use = next((use for use in board.uses() if use.signal == signal), None) or unwired(signal)
    wire = use.wire.model_copy(update={"pin": name, "allow": {}})
    found = pin_findings(board, board.pins, Use(signal, use.path, use.role, wire))
    return found[0].reason if found else f"{name} is wired to something else on {board.id} that cannot be moved"


def _rival(places: dict[str, int], signal: str, gpio: int) -> str:
    """One pin twice."""
    others = [other for other, at in places.items() if at == gpio and other != signal]
    return f"{others[0]} is at GPIO{gpio}, too" if others and gpio != PIN_NONE else ""
