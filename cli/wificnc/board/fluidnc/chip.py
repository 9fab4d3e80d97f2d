"""Which chip a configuration is for, by its pins: FluidNC's files do not say it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wificnc.board.chip import Chip, is_shifted, load_chips
from wificnc.files.problem import FileProblems, Problem

_CHIPS = {"esp32": "flash", "esp32s3": "quad"}  # and the memory that takes the fewest pins of most modules
_SURE = 2  # a pin alone may be a slip


def chip_of(board: dict[str, Any], path: Path) -> str:
    """The chip that has more of the pins.

    Raises:
        FileProblems: all but one pin are of both chips.
    """
    wrong = {name: _wrong_pins(board, load_chips()["esp32", name], memory) for name, memory in _CHIPS.items()}
    classic, s3 = wrong["esp32"], wrong["esp32s3"]
    if len(classic) <= len(s3):
        return "esp32"
    if len(classic) >= _SURE or "s3" in str(board["source"]["board"]).lower():
        return "esp32s3"
    (pin,) = classic
    reason = f"{pin} cannot be used so on an ESP32, and every other pin is of an ESP32 and of an ESP32-S3"
    hint = f"correct {pin}; or name the chip: --chip esp32s3"
    raise FileProblems([Problem(path, 1, "unknown-chip", "", reason, hint)])


def wired_pins(part: Any) -> list[str]:
    """Pins of a board file, or of a part of one."""
    return [wire["pin"] for wire in _wires(part)]


def _wrong_pins(board: dict[str, Any], chip: Chip, memory: str) -> set[str]:
    """Pins that the chip lacks, that its memory has, or that it cannot drive."""
    return {wire["pin"] for wire in _wires(board) if not is_shifted(wire["pin"]) and not _can_be(wire, chip, memory)}


def _can_be(wire: dict[str, Any], chip: Chip, memory: str) -> bool:
    pin = chip.pin.get(wire["pin"])
    if pin is None or pin.taken_in(memory):
        return False
    return pin.input if "pull" in wire else pin.output


def _wires(part: Any) -> list[dict[str, Any]]:
    if isinstance(part, list):
        return [wire for item in part for wire in _wires(item)]
    if not isinstance(part, dict):
        return []
    return [part] if "pin" in part else [wire for item in part.values() for wire in _wires(item)]
