"""protocol/nvs.toml as Python objects: what the ESP32 stores in addition to the settings."""

from __future__ import annotations

import sys
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from wificnc.files.paths import ROOT
from wificnc.tables.settings import NVS_KEY_MAX

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

NVS_PATH = ROOT / "protocol" / "nvs.toml"

Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=NVS_KEY_MAX)]
Name = Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9_]*$")]
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Long = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]

PIN_NONE = 0xFF


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Text(_Strict):
    """A text key; lengths are bytes of UTF-8."""

    key: Key
    name: Name
    min: Annotated[int, Field(ge=1)]
    max: Annotated[int, Field(ge=1)]
    secret: bool
    help: Annotated[str, Field(min_length=1, max_length=95)]


class Number(_Strict):
    """A u8 key, a u16 or a u32. `wire`: the binary protocol's number of it, 0: it has none."""

    key: Key
    name: Name
    bits: Literal[8, 16, 32] = 8
    wire: Word = 0
    default: Long
    min: Long
    max: Long
    help: Annotated[str, Field(min_length=1, max_length=95)]

    @model_validator(mode="after")
    def _sound(self) -> Number:
        if not self.min <= self.default <= self.max < 1 << self.bits:
            raise ValueError(f"{self.key}: min, default and max do not fit each other, or not {self.bits} bits")
        return self

    @property
    def type(self) -> str:
        """As NVS calls it."""
        return f"u{self.bits}"


class Pin(_Strict):
    """A u8 key that moves a signal of the board to another pin."""

    key: Key
    signal: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    wire: Annotated[int, Field(ge=1, le=0xFFFF)]


class NvsTable(_Strict):
    """All of them."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    text: tuple[Text, ...] = Field(strict=False)
    number: tuple[Number, ...] = Field(strict=False)
    pin: tuple[Pin, ...] = Field(strict=False)

    @model_validator(mode="before")
    @classmethod
    def _expanded(cls, data: dict[str, Any]) -> dict[str, Any]:
        """A row with `count` stands for so many rows."""
        return {**data, "number": [each for row in data["number"] for each in _rows(row)]}

    @property
    def channel(self) -> tuple[Number, ...]:
        """The numbers of an I/O module, in the order of their wire keys."""
        return tuple(sorted((row for row in self.number if row.wire), key=lambda row: row.wire))

    @model_validator(mode="after")
    def _distinct(self) -> NvsTable:
        keys = [row.key for row in self.text] + [row.key for row in self.number] + [row.key for row in self.pin]
        if len(set(keys)) < len(keys):
            raise ValueError("two rows have the same key")
        return self


def _rows(row: dict[str, Any]) -> list[dict[str, Any]]:
    count = row.get("count", 1)
    if count == 1:
        return [row]
    plain = {key: value for key, value in row.items() if key != "count"}
    return [
        {
            **plain,
            "key": f"{row['key']}{n}",
            "name": f"{row['name']}_{n}",
            "wire": row["wire"] + n,
            "help": row["help"].replace("the channel", f"channel {n}"),
        }
        for n in range(count)
    ]


def parse_nvs(text: str) -> NvsTable:
    """The table from TOML text. Raises ValueError when the table itself is wrong."""
    return NvsTable.model_validate(tomllib.loads(text))


@lru_cache(maxsize=1)
def load_nvs() -> NvsTable:
    """The table of this WiFiCNC."""
    return parse_nvs(NVS_PATH.read_text(encoding="utf-8"))
