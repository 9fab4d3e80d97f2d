"""The tables that the web page is built with.

tables.json, boards.json and machines.json come from protocol/*.toml, boards/*.toml, targets/*/pins*.toml,
examples/machines/*.toml, core/gcode/status.h, cli/wificnc/simulator/look.py, cli/wificnc/profile/model.py and
targets/esp32/partitions.csv; edit those.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wificnc.board.model import Board
from wificnc.firmware.flash.plan import read_partitions

from generate.page_machines import machine_tables
from generate.page_tables import board_tables, page_tables
from generate.words import ALARMS_SOURCE, SOURCE, read_alarms, read_rows

PARTITIONS = "targets/esp32/partitions.csv"


def texts(root: Path, boards: list[Board]) -> dict[str, str]:
    """File name -> text. Raises FileProblems when a table is broken."""
    nvs = read_partitions((root / PARTITIONS).read_text(encoding="utf-8"))["nvs"]
    # Not from words.py, which this very run may be about to write.
    errors = {number: json.loads(text) for number, text in read_rows((root / SOURCE).read_text(encoding="utf-8"))}
    alarms = {
        row.number: json.loads(row.text) for row in read_alarms((root / ALARMS_SOURCE).read_text(encoding="utf-8"))
    }
    return {
        "tables.json": _json(page_tables(nvs, errors, alarms)),
        "boards.json": _json(board_tables(boards)),
        "machines.json": _json(machine_tables()),
    }


def _json(table: Any) -> str:
    return json.dumps(table, indent=1, ensure_ascii=False) + "\n"
