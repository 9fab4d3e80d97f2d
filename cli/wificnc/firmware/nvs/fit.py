"""Whether stored pins fit a board: the rules of board files, for signals that the storage moves to other pins."""

from __future__ import annotations

import re
from collections.abc import Sequence

from wificnc.board.chip import Chip, is_shifted, load_chips
from wificnc.board.model import Board, Use
from wificnc.board.pin_keys import PinKey, pin_keys, unwired
from wificnc.board.rules import pin_findings
from wificnc.errors import BoardError, FlashError
from wificnc.firmware.nvs.image import Entry
from wificnc.tables.nvs import PIN_NONE, load_nvs

CHANNEL_PIN = re.compile(r"io_p\d+")  # of an I/O module
GPIO_COUNT = 64  # from here on: outputs of shift registers, no pin
SHIFTED_MAX = 32


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
    if problems := _chip_problems(pins, _places(entries)):
        raise FlashError(
            "\n".join([*problems, "the image is for another chip and was not written"]),
            hint="make it for this board: `wificnc nvs build MACHINE --board BOARD`",
        )


def chips_that_fit(entries: Sequence[Entry]) -> list[str]:
    """Chips that have these pins, by their names; none where no pin is moved. Raises BoardError: there are pins, and no
    chip has them."""
    if not (places := _places(entries)):
        return []
    chips = [chip for (target, _), chip in load_chips().items() if target == "esp32"]
    problems = {chip.name: _chip_problems(chip, places) for chip in chips}
    if fitting := [name for name, found in problems.items() if not found]:
        return fitting
    lines = [line for found in problems.values() for line in found]
    hint = "--board BOARD checks them by the rules of that board; `wificnc boards list` has all of them"
    raise BoardError("\n".join(dict.fromkeys(lines)), hint)


def _places(entries: Sequence[Entry]) -> dict[str, int]:
    """Keys of pins, and where they are; without those that have none."""
    moved = {row.key for row in load_nvs().pin}
    found = {entry.key: int(entry.value) for entry in entries if entry.key in moved or CHANNEL_PIN.fullmatch(entry.key)}
    return {key: gpio for key, gpio in found.items() if gpio != PIN_NONE}


def _chip_problems(chip: Chip, places: dict[str, int]) -> list[str]:
    """What no board with this chip can have."""
    by_number = {pin.number: pin for name, pin in chip.pin.items() if not is_shifted(name)}
    signals = {row.key: row.signal for row in load_nvs().pin}
    problems = []
    for key, gpio in places.items():
        pin = by_number.get(gpio)
        others = [other for other, at in places.items() if at == gpio and other != key]
        is_output = key in signals and unwired(signals[key]).is_output
        if pin is None and not GPIO_COUNT <= gpio < GPIO_COUNT + SHIFTED_MAX:
            problems.append(f"{key}={gpio}: the {chip.name} has no GPIO{gpio}")
        elif pin is not None and pin.taken and not pin.taken.memory:
            problems.append(f"{key}={gpio}: GPIO{gpio} of the {chip.name} is taken by {pin.taken.by}")
        elif pin is not None and is_output and not pin.output:
            problems.append(f"{key}={gpio}: GPIO{gpio} of the {chip.name} can only be read")
        elif others:
            problems.append(f"{key}={gpio}: {others[0]} is at GPIO{gpio}, too")
    return problems


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
