"""core/settings seen through ctypes, and the table read by the standard parser as its oracle."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from layouts import HOST

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
AXES = 6


@dataclass(frozen=True)
class Numbered:
    """One $N: the table's row, and which element of its field."""

    number: int
    index: int
    row: dict[str, Any]

    @property
    def is_float(self) -> bool:
        return self.row["type"] == "float"

    @property
    def max(self) -> float:
        return self.row.get("max", 1)

    @property
    def min(self) -> float:
        return self.row.get("min", 0)


TABLE: list[dict[str, Any]] = tomllib.loads((ROOT / "protocol/settings.toml").read_text(encoding="utf-8"))["setting"]
for _row in TABLE:
    if "choice" in _row:
        _row["max"] = len(_row["choice"]) - 1
NUMBERS = [
    Numbered(row["number"] + index, index, row) for row in TABLE for index in range(AXES if row.get("per_axis") else 1)
]


Row = HOST.struct("setting_row")
Values = HOST.struct("settings")


class Settings:
    """A struct settings and the functions of settings.h on it."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library = library
        self.values = Values()
        library.settings_defaults(ctypes.byref(self.values))

    def set(self, number: int, value: float, axes: int = AXES) -> int:
        return int(self.library.settings_set(ctypes.byref(self.values), number, value, axes))

    def get(self, number: int, axes: int = AXES) -> tuple[float, int] | None:
        value, decimals = ctypes.c_double(-1), ctypes.c_uint8(99)
        known = self.library.settings_get(
            ctypes.byref(self.values), number, axes, ctypes.byref(value), ctypes.byref(decimals)
        )
        return (value.value, decimals.value) if known else None

    def value(self, number: int) -> float:
        found = self.get(number)
        assert found is not None
        return found[0]

    def walk(self, axes: int = AXES) -> Iterator[int]:
        number = ctypes.c_uint16(0xFFFF)
        while self.library.settings_next(ctypes.byref(number), axes):
            yield number.value

    def image(self) -> bytes:
        return bytes(self.values)

    def report(self, axes: int = AXES) -> list[str]:
        """What $$ prints."""
        found = ((number, self.get(number, axes)) for number in self.walk(axes))
        return [f"${number}={got[0]:.{got[1]}f}" for number, got in found if got]
