"""protocol/nvs.toml as Python objects: what the ESP32 stores beside the settings."""

from __future__ import annotations

import sys
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from wificnc.checked.paths import ROOT
from wificnc.protocol.table import NVS_KEY_MAX

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

NVS_PATH = ROOT / "protocol" / "nvs.toml"

Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=NVS_KEY_MAX)]
Name = Annotated[str, Field(pattern=r"^[A-Z][A-Z_]*$")]
Byte = Annotated[int, Field(ge=0, le=0xFF)]

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
    """A u8 key."""

    key: Key
    name: Name
    default: Byte
    min: Byte
    max: Byte
    help: Annotated[str, Field(min_length=1, max_length=95)]


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

    @model_validator(mode="after")
    def _distinct(self) -> NvsTable:
        keys = [row.key for row in self.text] + [row.key for row in self.number] + [row.key for row in self.pin]
        if len(set(keys)) < len(keys):
            raise ValueError("two rows have the same key")
        return self


def parse_nvs(text: str) -> NvsTable:
    """The table from TOML text. Raises ValueError when the table itself is wrong."""
    return NvsTable.model_validate(tomllib.loads(text))


@lru_cache(maxsize=1)
def load_nvs() -> NvsTable:
    """The table of this WiFiCNC."""
    return parse_nvs(NVS_PATH.read_text(encoding="utf-8"))
