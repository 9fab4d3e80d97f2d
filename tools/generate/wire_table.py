"""protocol/wmc3.toml as Python objects: every packet of the binary protocol with its fields, enums and keys."""

from __future__ import annotations

import re
import sys
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator
from wificnc.tables.nvs import NvsTable
from wificnc.tables.settings import Convert, SettingsTable

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

# type of a field -> its struct code
CODES = {"u8": "B", "u16": "H", "u32": "I", "i8": "b", "i32": "i", "char": "s"}
SIZES = {"u8": 1, "u16": 2, "u32": 4, "i8": 1, "i32": 4, "char": 1}
Order = Literal["jog", "jog_stop", "hold", "estop", "outputs"]  # SESSION_ORDER_ of core/session/session.h
SAME = ("value", "pwm_hz")  # conversions that keep the setting's range
ValueType = Literal["u8", "u16", "u32", "i32", "float", "string"]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class EnumValue(_Strict):
    name: str
    value: int
    help: Annotated[str, Field(min_length=1)]
    remedy: str = ""  # of a refusal: what a host does then


class Enum(_Strict):
    """Numbers with names; flags: bits that are or-ed."""

    name: str
    help: str
    flags: bool = False
    values: tuple[EnumValue, ...] = Field(strict=False)

    @model_validator(mode="before")
    @classmethod
    def _rows(cls, data: dict[str, Any]) -> dict[str, Any]:
        rows = [dict(zip(("name", "value", "help", "remedy")[: len(row)], row, strict=True)) for row in data["values"]]
        return {**data, "values": rows}


class WireField(_Strict):
    """One field; `offset` counts from the begin of its struct or payload."""

    name: str
    type: Literal["u8", "u16", "u32", "i8", "i32", "char"]
    count: int
    unit: str
    help: str
    offset: int = 0

    @property
    def size(self) -> int:
        return SIZES[self.type] * self.count

    @property
    def is_reserved(self) -> bool:
        return self.name == "reserved"

    @property
    def code(self) -> str:
        """For Python's struct: `I`, `6i`, `32s`, `3x`."""
        if self.is_reserved:
            return f"{self.size}x"
        return CODES[self.type] if self.count == 1 else f"{self.count}{CODES[self.type]}"


class _WithFields(_Strict):
    name: str
    help: str
    fields: tuple[WireField, ...] = Field(strict=False)

    @model_validator(mode="before")
    @classmethod
    def _rows(cls, data: dict[str, Any]) -> dict[str, Any]:
        fields, offset = [], 0
        for name, kind, unit, words in data["fields"]:
            found = re.fullmatch(r"(\w+?)(?:\[(\d+)\])?", kind)
            if not found or found[1] not in SIZES:
                raise ValueError(f"{data['name']}.{name}: no such type: {kind}")
            count = int(found[2] or 1)
            fields.append(
                {"name": name, "type": found[1], "count": count, "unit": unit, "help": words, "offset": offset}
            )
            offset += SIZES[found[1]] * count
        return {**data, "fields": fields}

    @property
    def size(self) -> int:
        return sum(field.size for field in self.fields)

    @property
    def named(self) -> tuple[WireField, ...]:
        """All but the reserved ones."""
        return tuple(field for field in self.fields if not field.is_reserved)

    @property
    def format(self) -> str:
        return "<" + "".join(field.code for field in self.fields)


class WireStruct(_WithFields):
    """A part of packets."""


class Packet(_WithFields):
    """A packet's payload; `repeat` names the struct that follows it as often as `count` says."""

    type: Annotated[int, Field(ge=1, le=0xFF)]
    channel: Literal["UDP", "TCP"]
    sender: Annotated[Literal["host", "device"], Field(alias="from")]
    origin: Literal["wmc3", "ours"] = "wmc3"
    reply: str = ""
    repeat: str = ""
    needs: tuple[Literal["machine", "module", "may", "login"], ...] = Field(default=(), strict=False)
    example: tuple[int, ...] = Field(default=(), strict=False)  # a number for each field
    order: Order | None = None
    after: tuple[Order, ...] = Field(default=(), strict=False)

    @property
    def only_asks(self) -> bool:
        """Anybody may send it in any state: it changes nothing, and its reply says how things are."""
        return self.sender == "host" and self.reply not in ("", "ack", "authenticated") and "may" not in self.needs

    @property
    def channels(self) -> tuple[str, ...]:
        """Those that a host may send it by: a command goes by TCP, too."""
        return (self.channel,) if self.channel == "TCP" or self.repeat else ("UDP", "TCP")


class Key(_Strict):
    """Configuration keys, `count` of them from `key` on. Of a setting: its number and how to convert."""

    key: Annotated[int, Field(ge=1, le=0xFFFF)]
    name: str
    count: Annotated[int, Field(ge=1, le=16)] = 1
    type: ValueType
    unit: str = ""
    kind: Literal["setting", "fixed", "target", "pin", "stored", "state"] = "setting"
    signals: tuple[str, ...] = Field(default=(), strict=False)  # of a pin: the first that a board wires
    default: int | str = 0
    setting: str = ""
    convert: Annotated[Convert, Field(alias="as")] = "value"
    number: int = 0
    least: float | None = None  # where a value goes as it is: the range of the setting, or of the stored one
    most: float | None = None
    help: str


class WireTable(_Strict):
    """All of the protocol."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    constants: dict[str, int]
    enum: tuple[Enum, ...] = Field(strict=False)
    struct: tuple[WireStruct, ...] = Field(strict=False)
    packet: tuple[Packet, ...] = Field(strict=False)
    key: tuple[Key, ...] = Field(strict=False)

    @model_validator(mode="after")
    def _consistent(self) -> WireTable:
        names = {packet.name for packet in self.packet}
        structs = {struct.name: struct for struct in self.struct}
        types = [packet.type for packet in self.packet]
        for low, high in pairwise(sorted(types)):
            if low == high:
                raise ValueError(f"two packets have type 0x{low:02X}")
        for packet in self.packet:
            if packet.sender == "device" and (packet.needs or packet.order or packet.after):
                raise ValueError(f"{packet.name}: needs, order and after are for packets of a host")
            if packet.sender == "host" and packet.channel == "TCP" and not packet.reply:
                raise ValueError(f"{packet.name}: a request needs a reply")
            if packet.reply and packet.reply not in names:
                raise ValueError(f"{packet.name}: there is no reply {packet.reply}")
            if packet.repeat and packet.repeat not in structs:
                raise ValueError(f"{packet.name}: there is no struct {packet.repeat}")
        return self


def parse_wire(text: str, settings: SettingsTable, nvs: NvsTable) -> WireTable:
    """The table from TOML text, with the keys of settings added, in ascending order of keys.

    Raises ValueError when a table is wrong, a key is there twice, or a stored one is not in both tables.
    """
    table = WireTable.model_validate(tomllib.loads(text))
    _check_stored(table.key, nvs)
    keys = [*_resolved(_with_ranges(table.key, nvs), settings), *_of_settings(settings)]
    keys.sort(key=lambda key: key.key)
    for low, high in pairwise(keys):
        if high.key < low.key + low.count:
            raise ValueError(f"key 0x{high.key:04X} {high.name} is given twice")
    return table.model_copy(update={"key": tuple(keys)})


def _resolved(keys: tuple[Key, ...], settings: SettingsTable) -> list[Key]:
    """Keys of this table that stand for a setting get its number."""
    return [key.model_copy(update={"number": settings[key.setting].number}) if key.setting else key for key in keys]


def _with_ranges(keys: tuple[Key, ...], nvs: NvsTable) -> tuple[Key, ...]:
    """Stored keys get theirs."""
    stored = {row.wire: {"least": row.min, "most": row.max} for row in nvs.channel}
    return tuple(key.model_copy(update=stored.get(key.key, {})) for key in keys)


def _check_stored(keys: tuple[Key, ...], nvs: NvsTable) -> None:
    ours = {key.key + n: key.type for key in keys if key.kind == "stored" for n in range(key.count)}
    theirs = {row.wire: row.type for row in nvs.channel}
    for key in sorted({*ours, *theirs}):
        if ours.get(key) != theirs.get(key):
            raise ValueError(f"key 0x{key:04X}: {ours.get(key)} here, {theirs.get(key)} in protocol/nvs.toml")


def _of_settings(settings: SettingsTable) -> list[Key]:
    return [
        Key.model_validate(
            {
                "key": row.wire.key, "name": row.name, "count": row.count, "type": row.wire.type,
                "unit": row.wire.unit or row.unit, "setting": row.name, "as": row.wire.convert,
                "number": row.number, "help": row.help,
                **({"least": row.min, "most": row.max} if row.wire.convert in SAME and row.type != "bool" else {}),
            }
        )
        for row in settings.setting
        if row.wire
    ]  # fmt: skip
