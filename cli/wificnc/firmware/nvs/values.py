"""From what people know, settings and names, to NVS keys, and back."""

from __future__ import annotations

import re
import secrets
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from wificnc.connection.access import normal_key
from wificnc.errors import UserError
from wificnc.files.digits import whole_number
from wificnc.firmware.nvs.image import Entry, NvsImage, Value
from wificnc.profile.model import Machine
from wificnc.tables import AXES, load_settings
from wificnc.tables.nvs import PIN_NONE, load_nvs

NAMESPACE = "wificnc"
LETTERS = "abcdefghijkmnpqrstuvwxyz23456789"  # that no one mistakes for one another
OWN_PASSWORD_LENGTH = 12
SETTING_TYPES = {"bool": "u8", "u8": "u8", "u16": "u16", "float": "u32"}
HIDDEN = "********"


@dataclass(frozen=True)
class SettingKey:
    """Where a $ setting lies."""

    number: int
    key: str
    type: str  # of the setting
    name: str


def setting_keys() -> list[SettingKey]:
    """Of every setting of protocol/settings.toml."""
    return [
        SettingKey(row.number + index, row.nvs.format(axis=AXES[index].lower()), row.type, row.name)
        for row in load_settings().setting
        for index in range(row.count)
    ]


def setting_entry(key: SettingKey, value: float) -> Entry:
    """A float lies there as the u32 with its bits."""
    stored = struct.unpack("<I", struct.pack("<f", value))[0] if key.type == "float" else int(value)
    return Entry(NAMESPACE, key.key, SETTING_TYPES[key.type], stored)


def machine_entries(machine: Machine) -> list[Entry]:
    """The settings of a machine profile."""
    keys = {key.number: key for key in setting_keys()}
    return [setting_entry(keys[number], value) for number, value in machine.settings().items()]


def text_entry(key: str, value: str) -> Entry:
    """A text of protocol/nvs.toml. Raises UserError when it is too short or too long."""
    row = next(row for row in load_nvs().text if row.key == key)
    size = len(value.encode())
    counted = len(normal_key(value)) if key == "access_key" else size  # its dashes and spaces are no part of it
    if counted < row.min or size > row.max:
        raise UserError(
            f"{key}: {min(counted, size)} bytes, but it takes {row.min} to {row.max}",
            hint=f"{row.help} Letters beyond ASCII count as two bytes or more.",
        )
    return Entry(NAMESPACE, key, "string", value)


def number_entry(text: str) -> Entry:
    """`dev_mode=1` or `p_sx=4`, a number or pin of protocol/nvs.toml. Raises UserError."""
    key, _, value = text.partition("=")
    table = load_nvs()
    known = {row.key: (row.type, row.min, row.max) for row in table.number}
    known |= {row.key: ("u8", 0, PIN_NONE) for row in table.pin}
    if key not in known:
        raise UserError(f"no such key: {key!r}", hint=f"keys: {', '.join(known)}")
    kind, low, high = known[key]
    number = _whole_number(value)
    if number is None or not low <= number <= high:
        raise UserError(f"{key}: {value!r} is not a number from {low} to {high}")
    return Entry(NAMESPACE, key, kind, number)


def _whole_number(text: str) -> int | None:
    """Decimal, or a mask as 0x00FF."""
    digits, base = (text[2:], 16) if text[:2] in ("0x", "0X") else (text, 10)
    return whole_number(digits, base) if re.fullmatch("[0-9a-fA-F]+" if base == 16 else "[0-9]+", digits) else None


def random_password() -> str:
    """For the controller's own network."""
    return "".join(secrets.choice(LETTERS) for _ in range(OWN_PASSWORD_LENGTH))


def merged(image: NvsImage, changes: Iterable[Entry]) -> list[Entry]:
    """All entries of an image, with these instead of theirs."""
    entries = dict(image.entries)
    for entry in changes:
        entries[entry.namespace, entry.key] = entry
    return list(entries.values())


def without(image: NvsImage, keys: Iterable[str]) -> NvsImage:
    """An image without some of our keys."""
    gone = {(NAMESPACE, key) for key in keys}
    return NvsImage({where: entry for where, entry in image.entries.items() if where not in gone}, image.damaged)


@dataclass(frozen=True)
class Row:
    """An entry for people."""

    key: str
    meaning: str  # "$110 max_rate", or what protocol/nvs.toml says
    value: str


def rows(image: NvsImage, show_secrets: bool) -> list[Row]:
    """Our own keys, settings first; what we do not know is at the end."""
    known = _meanings()
    ours = {key: entry for (namespace, key), entry in image.entries.items() if namespace == NAMESPACE}
    order = [*(key for key in known if key in ours), *sorted(key for key in ours if key not in known)]
    return [_row(ours[key], known.get(key), show_secrets) for key in order]


def secret_keys() -> frozenset[str]:
    return frozenset(row.key for row in load_nvs().text if row.secret)


def _meanings() -> Mapping[str, tuple[str, str]]:
    """Key -> type and meaning."""
    known = {key.key: (key.type, f"${key.number} {key.name}") for key in setting_keys()}
    table = load_nvs()
    known |= {row.key: ("text", row.help) for row in table.text}
    known |= {row.key: ("number", row.help) for row in table.number}
    return known | {row.key: ("pin", f"GPIO of {row.signal}; 255: none") for row in table.pin}


def _row(entry: Entry, known: tuple[str, str] | None, show_secrets: bool) -> Row:
    kind, meaning = known or ("", "not known to this version")
    if entry.key in secret_keys() and not show_secrets:
        return Row(entry.key, meaning, HIDDEN)
    return Row(entry.key, meaning, _text(kind, entry.value))


def _text(kind: str, value: Value) -> str:
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if kind == "float" and isinstance(value, int):
        number = struct.unpack("<f", struct.pack("<I", value & 0xFFFFFFFF))[0]
        return f"{number:.7g}"
    return str(value)


def differences(first: NvsImage, second: NvsImage, show_secrets: bool) -> list[tuple[str, str, str, str]]:
    """Key, meaning, value in the first, value in the second; "" where it is missing."""
    sides = [{row.key: row for row in rows(image, True)} for image in (first, second)]
    found = []
    for key in dict.fromkeys([*sides[0], *sides[1]]):
        one, other = sides[0].get(key), sides[1].get(key)
        if one is None or other is None or one.value != other.value:
            shown = [HIDDEN if row and key in secret_keys() and not show_secrets else row.value if row else ""
                     for row in (one, other)]  # fmt: skip
            found.append((key, (one or other or Row("", "", "")).meaning, shown[0], shown[1]))
    return found
