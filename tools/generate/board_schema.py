"""The JSON Schema of a board file, for editors that complete and check TOML."""

from __future__ import annotations

import json
from typing import Any

from wificnc.board.model import BoardFile
from wificnc.board.rules import ALLOWABLE

_WIRES = ("OutputWire", "InputWire")


def board_schema_text() -> str:
    """board.schema.json."""
    schema = BoardFile.model_json_schema()
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "WiFiCNC board",
        **{key: value for key, value in schema.items() if key != "title"},
    }
    for name in _WIRES:
        schema["$defs"][name] = _wire(schema["$defs"][name])
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _wire(table: dict[str, Any]) -> dict[str, Any]:
    """A wire is a table, or just the pin's name."""
    allow = table["properties"]["allow"]
    allow["properties"] = dict.fromkeys(ALLOWABLE, allow["additionalProperties"])
    allow["additionalProperties"] = False
    pin = table["properties"]["pin"]["description"]
    return {"description": table["description"], "anyOf": [{"type": "string", "description": pin}, table]}
