"""Whole packets as text that says which bytes are what: the examples of docs/protocol.md.

Those of protocol/vectors were made by others. A packet that is not there is made from its `example` in wmc3.toml.
"""

from __future__ import annotations

import binascii
import re
import struct
import sys
from dataclasses import dataclass

from generate.wire_table import CODES, SIZES, Enum, Packet, WireField, WireStruct, WireTable

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

AXES = "XYZABC"
ZEROS_MIN = 16  # so many at the end are counted, not written


@dataclass(frozen=True)
class Example:
    """One packet: the text for each of its fields, and the block of text of all of them."""

    name: str
    data: bytes
    header: tuple[str, ...]  # hex of each field of the header
    text: str


def parse_examples(source: str, table: WireTable) -> dict[str, Example]:
    """The first vector of each packet, or its own example: by name. Raises ValueError when a packet has neither."""
    found: dict[str, Example] = {}
    for vector in tomllib.loads(source)["vector"]:
        data = bytes.fromhex(vector["hex"]) + bytes(vector.get("zeros", 0))
        found.setdefault(vector["name"], _example(table, vector["name"], data))
    others = [packet for packet in table.packet if packet.name not in found]
    if missing := ", ".join(sorted(packet.name for packet in others if len(packet.example) != len(packet.named))):
        raise ValueError(f"no vector in protocol/vectors/packets.toml, and no `example` of each field: {missing}")
    return found | {packet.name: _example(table, packet.name, _made(table, packet)) for packet in others}


def _made(table: WireTable, packet: Packet) -> bytes:
    """The packet with the numbers of its example."""
    head = struct.Struct(table.struct[0].format)
    body = struct.pack(packet.format, *packet.example)
    start = (table.constants["magic"], table.constants["version"], packet.type, len(body), 0, 0)
    checksum = binascii.crc_hqx(head.pack(*start, 0) + body, 0xFFFF)
    return head.pack(*start, checksum) + body


def framed(example: Example) -> str:
    """As it goes by TCP: the size before it."""
    size = struct.pack("<H", len(example.data)).hex()
    at = re.search(r"  +\S", example.text)
    width = at.end() - 1 if at else 0
    return f"{size:<{width}}size of the packet = {len(example.data)}\n{example.text}"


def _example(table: WireTable, name: str, data: bytes) -> Example:
    packet = next(packet for packet in table.packet if packet.name == name)
    head, body = table.struct[0], data[table.struct[0].size :]
    header = tuple(data[field.offset : field.offset + field.size].hex() for field in head.fields)
    numbers = {field.name: _number(field, data) for field in head.fields}
    first = f"header: 0x{packet.type:02X} {name}, sequence {numbers['sequence']}, {numbers['timestamp_us']} us"
    rows = [(" ".join(header), first), *_rows(table, packet, body)]
    width = max(len(shown) for shown, _ in rows) + 2
    return Example(name, data, header, "\n".join(f"{shown:<{width}}{words}" for shown, words in rows))


def _rows(table: WireTable, packet: Packet, body: bytes) -> list[tuple[str, str]]:
    rows = _fields(table, packet, body)
    if packet.repeat:
        part = next(struct for struct in table.struct if struct.name == packet.repeat)
        count = body[next(field.offset for field in packet.fields if field.name == "count")]
        for n in range(count):
            rows += _fields(table, part, body[packet.size + n * part.size :], f"{part.name} {n}: ")
    return rows


def _fields(table: WireTable, item: Packet | WireStruct, body: bytes, prefix: str = "") -> list[tuple[str, str]]:
    return [
        (
            _hex(field, body),
            prefix + (field.name if field.is_reserved else f"{field.name} = {_value(table, field, body)}"),
        )
        for field in item.fields
    ]


def _hex(field: WireField, body: bytes) -> str:
    data = body[field.offset : field.offset + field.size]
    zeros = len(data) - len(data.rstrip(b"\0"))
    if zeros >= ZEROS_MIN:
        kept = data[: len(data) - zeros].hex()
        return f"{kept} + {zeros} x 00".strip() if kept else f"{zeros} x 00"
    step = SIZES[field.type] if SIZES[field.type] > 1 else len(data)
    return " ".join(data[at : at + step].hex() for at in range(0, len(data), step))


def _number(field: WireField, data: bytes) -> int:
    return int(struct.unpack_from("<" + CODES[field.type], data, field.offset)[0])


def _value(table: WireTable, field: WireField, body: bytes) -> str:
    data = body[field.offset : field.offset + field.size]
    if field.type == "char":
        return data.rstrip(b"\0").decode()
    if field.count > 1:
        numbers = struct.unpack("<" + CODES[field.type] * field.count, data)
        return "bytes" if SIZES[field.type] == 1 else ", ".join(str(number) for number in numbers)
    number = _number(field, body)
    words = _words(table, field, number)
    return f"{number}{f' ({words})' if words else ''}"


def _words(table: WireTable, field: WireField, number: int) -> str:
    """What the number stands for."""
    enum = next((enum for enum in table.enum if enum.name == field.unit), None)
    if enum is not None:
        return _enum_words(enum, number)
    if field.unit == "axis mask":
        return "".join(letter for n, letter in enumerate(AXES) if number >> n & 1)
    if field.name == "type":
        return next((packet.name for packet in table.packet if packet.type == number), "")
    if field.name == "key":
        return next((f"0x{number:04X} {key.name}" for key in table.key if key.key <= number < key.key + key.count), "")
    return ""


def _enum_words(enum: Enum, number: int) -> str:
    if enum.flags:
        return ", ".join(value.name for value in enum.values if number & value.value)
    return next((value.name for value in enum.values if value.value == number), "")
