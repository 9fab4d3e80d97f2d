"""Board files and machine profiles as TOML, as one writes them by hand: a pin by its name where that says all."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

_USUAL = {"active": "high"}
_USUAL_INPUT = {"active": "low", "pull": "up"}


def toml_text(comments: Sequence[str], data: dict[str, Any]) -> str:
    """@param comments  lines above everything"""
    lines = [f"# {line}".rstrip() for line in comments]
    lines += _table((), data)
    return "\n".join(lines).rstrip() + "\n"


def _table(path: tuple[str, ...], table: dict[str, Any]) -> list[str]:
    inner = {key: value for key, value in table.items() if isinstance(value, dict) and "pin" not in value}
    lines = [f"{key} = {_value(value)}" for key, value in table.items() if key not in inner]
    if path and lines:
        lines = ["", f"[{'.'.join(path)}]", *lines]
    for key, value in inner.items():
        lines += _table((*path, key), value)
    return lines


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return _wire(value) if "pin" in value else _inline(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.6f}".rstrip("0").rstrip(".") if abs(value) < 1e15 else repr(value)
    return json.dumps(value, ensure_ascii=False)


def _wire(wire: dict[str, Any]) -> str:
    usual = _USUAL_INPUT if "pull" in wire else _USUAL
    said = {key: value for key, value in wire.items() if usual.get(key) != value}
    return _value(wire["pin"]) if said.keys() == {"pin"} else _inline(said)


def _inline(table: dict[str, Any]) -> str:
    return f"{{ {', '.join(f'{key} = {_value(value)}' for key, value in table.items())} }}"
