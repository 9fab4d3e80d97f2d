"""Everything that the page knows of boards, settings, storage and words, from the tables that are their one home.

Pins are judged here, by the board's own rules and by the list that the firmware goes by; the page only looks up.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from wificnc import __version__
from wificnc.board.chip import is_shifted
from wificnc.board.header import is_movable_to
from wificnc.board.labels import label, notes
from wificnc.board.model import Board, Role, Use
from wificnc.board.picture import ROLE_COLOURS
from wificnc.board.rules import pin_findings
from wificnc.board.wire import InputWire, OutputWire
from wificnc.connection import realtime
from wificnc.firmware.flash.plan import Partition
from wificnc.firmware.nvs.values import NAMESPACE
from wificnc.simulator.look import look_table
from wificnc.simulator.serve.options import board_numbers
from wificnc.tables import AXES, load_settings
from wificnc.tables.nvs import PIN_NONE, load_nvs

from generate.nvs import is_output

Json = dict[str, Any]
Words = Mapping[int, str]
SETTING_KEYS = {
    "number",
    "name",
    "type",
    "unit",
    "default",
    "min",
    "max",
    "decimals",
    "per_axis",
    "reboot",
    "help",
    "affects",
    "nvs",
}


def board_tables(boards: list[Board]) -> list[Json]:
    """A row for each board, in this order."""
    return [_board(board) for board in boards]


def page_tables(nvs_partition: Partition, errors: Words, alarms: Words) -> Json:
    """All but the boards. Same tables, same text. @param errors, alarms  number -> text"""
    return {
        "version": __version__,
        "axes": AXES,
        "settings": [row.model_dump(include=SETTING_KEYS) for row in load_settings().setting],
        "errors": {str(code): text for code, text in errors.items()},
        "alarms": {str(code): text for code, text in alarms.items()},
        "realtime": {name: value[0] for name, value in vars(realtime).items() if isinstance(value, bytes)},
        "storage": _storage(nvs_partition),
        "look": look_table(),
    }


def _storage(partition: Partition) -> Json:
    table = load_nvs()
    return {
        "namespace": NAMESPACE,
        "offset": partition.offset,
        "size": partition.size,
        "none": PIN_NONE,
        "text": [row.model_dump(exclude={"name"}) for row in table.text],
        "number": [row.model_dump(exclude={"name", "wire"}) for row in table.number],
        "pin": [
            {"key": row.key, "signal": row.signal, "label": label(row.signal), "output": is_output(row.signal)}
            for row in table.pin
        ],
    }


def _board(board: Board) -> Json:
    flashes = board.target == "esp32"
    return {
        "id": board.id,
        "name": board.name,
        "summary": board.summary,
        "target": board.target,
        "chip": board.chip,
        "chip_name": board.pins.name,
        "memory": board.pins.memory[board.memory.mode],
        "flash_mb": list(board.memory.flash_mb),
        "psram_mb": list(board.memory.psram_mb),
        "axes": "".join(board.axes),
        "ethernet": board.ethernet is not None,
        "step_rate_hz": board.timing.max_step_rate_hz,
        "notes": notes(board),
        "uses": [_use(board, use) for use in board.uses()],
        "pins": list(_pins(board)) if flashes else [],
        "host": board_numbers(board),
    }


def _use(board: Board, use: Use) -> Json:
    return {
        "signal": use.signal,
        "label": label(use.signal),
        "role": use.role.value,
        "colour": ROLE_COLOURS[use.role],
        "pin": use.pin,
        "number": board.pins.pin[use.pin].number,
    }


def _pins(board: Board) -> Iterator[Json]:
    """Every pin of the chip: whether a signal can be moved there, else why not. None: it can."""
    probe = {
        "output": Use("", (), Role.MISC, OutputWire(pin="")),
        "input": Use("", (), Role.MISC_IN, InputWire(pin="", pull="none")),
    }
    for name, pin in board.pins.pin.items():
        refused = {kind: _refusal(board, name, use) for kind, use in probe.items()}
        yield {"name": name, "number": pin.number, **refused}


def _refusal(board: Board, pin: str, use: Use) -> list[str] | None:
    """Sentences with {0} for the pin, so that a translation serves all pins; the page adds whose pin it is."""
    if is_movable_to(board, pin, "output" if use.is_output else "input"):
        return None
    moved = Use(use.signal, use.path, use.role, use.wire.model_copy(update={"pin": pin}))
    reasons = [found.reason for found in pin_findings(board, board.pins, moved)]
    if is_shifted(pin) and board.use_of(pin) is None:
        reasons.insert(0, f"{pin} is soldered to what it drives")
    return [re.sub(rf"\b{re.escape(pin)}\b", "{0}", reason) for reason in reasons]
