"""Reads an NVS partition: ESP-IDF, "NVS Partition Structure". Every CRC is checked.

page, 4096 bytes   state u32 | sequence u32 | version u8 | 19 unused | crc32 u32        of bytes 4..27
                   32 bytes: 2 bits an entry: 11 empty, 10 written, 00 erased
                   126 entries of 32 bytes
entry              namespace u8 | type u8 | span u8 | chunk u8 | crc32 u32 | key 16 | data 8
                   texts and blobs: size u16 | - | crc32 u32, then span - 1 entries of bytes
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

from wificnc.errors import FlashError

PAGE, ENTRY, ENTRIES = 4096, 32, 126
BITMAP_AT, ENTRIES_AT = 32, 64
VERSION_2 = 0xFE  # versions count down
EMPTY_PAGE, CORRUPT_PAGE = 0xFFFFFFFF, 0
WRITTEN = 0b10
NAMESPACES, ANY_CHUNK = 0, 0xFF
TEXT, BLOB_V1, BLOB_DATA, BLOB_INDEX = 0x21, 0x41, 0x42, 0x48
NUMBERS = {0x01: "u8", 0x11: "i8", 0x02: "u16", 0x12: "i16", 0x04: "u32", 0x14: "i32", 0x08: "u64", 0x18: "i64"}
FORMATS = {"u8": "<B", "i8": "<b", "u16": "<H", "i16": "<h", "u32": "<I", "i32": "<i", "u64": "<Q", "i64": "<q"}

Value = int | str | bytes


@dataclass(frozen=True)
class Entry:
    """A key with its value. `type`: u8 … i64, string, blob."""

    namespace: str
    key: str
    type: str
    value: Value


@dataclass
class NvsImage:
    """What is stored, and what was found damaged and left out."""

    entries: dict[tuple[str, str], Entry] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)

    def get(self, namespace: str, key: str) -> Value | None:
        entry = self.entries.get((namespace, key))
        return None if entry is None else entry.value


@dataclass(frozen=True)
class _Raw:
    """An entry as it lies there; its bytes are checked."""

    namespace: int
    type: int
    chunk: int
    key: str
    data: bytes


def read_image(data: bytes) -> NvsImage:
    """Raises FlashError when it is not a NVS partition, or one of a newer layout than this program supports."""
    if len(data) < PAGE or len(data) % PAGE:
        raise FlashError(f"{len(data)} bytes are not an NVS partition: its size is a multiple of {PAGE} bytes")
    image = NvsImage()
    raws = [raw for page in _pages(data, image) for raw in _entries(page, image)]
    names = {raw.data[0]: raw.key for raw in raws if raw.namespace == NAMESPACES}
    chunks = {(raw.namespace, raw.key, raw.chunk): raw.data for raw in raws if raw.type == BLOB_DATA}
    for raw in raws:
        if raw.namespace == NAMESPACES or raw.type == BLOB_DATA:
            continue
        name = names.get(raw.namespace)
        if name is None:
            image.damaged.append(f"{raw.key} is in a namespace without a name")
            continue
        entry = _entry(name, raw, chunks)
        if entry is None:
            image.damaged.append(f"{name}/{raw.key} is incomplete")
        else:
            image.entries[name, raw.key] = entry
    return image


def _pages(data: bytes, image: NvsImage) -> list[bytes]:
    """Pages in use, oldest first: what is written later counts."""
    used = []
    for at in range(0, len(data), PAGE):
        page = data[at : at + PAGE]
        state, sequence, version = struct.unpack_from("<IIB", page)
        if state in (EMPTY_PAGE, CORRUPT_PAGE):
            continue
        (crc,) = struct.unpack_from("<I", page, 28)
        if crc != _crc(page[4:28]):
            image.damaged.append(f"page at 0x{at:X}: its header has a wrong checksum")
        elif version < VERSION_2:
            raise FlashError(
                f"this NVS has a newer layout (version 0x{version:02X}) than this program supports",
                hint="upgrade wificnc: docs/start/README.md says how",
            )
        else:
            used.append((sequence, page))
    if not used and data.strip(b"\xff"):
        raise FlashError("not an NVS partition: no page has a valid header")
    return [page for _, page in sorted(used)]


def _entries(page: bytes, image: NvsImage) -> Iterator[_Raw]:
    index = 0
    while index < ENTRIES:
        bits = page[BITMAP_AT + index // 4] >> 2 * (index % 4) & 0b11
        at = ENTRIES_AT + index * ENTRY
        index += 1
        if bits != WRITTEN:
            continue
        entry = page[at : at + ENTRY]
        namespace, kind, span, chunk, crc = struct.unpack_from("<BBBBI", entry)
        if crc != _crc(entry[:4] + entry[8:]) or not 1 <= span <= ENTRIES - index + 1:
            image.damaged.append("an entry has a wrong checksum")
            continue
        key = entry[8:24].split(b"\0")[0].decode("latin-1")
        index += span - 1
        data = entry[24:]
        if kind in (TEXT, BLOB_V1, BLOB_DATA):
            size, data_crc = struct.unpack_from("<H2xI", data)
            data = page[at + ENTRY : at + ENTRY + size]
            if size > (span - 1) * ENTRY or data_crc != _crc(data):
                image.damaged.append(f"{key}: its value has a wrong checksum")
                continue
        yield _Raw(namespace, kind, chunk, key, data)


def _entry(name: str, raw: _Raw, chunks: dict[tuple[int, str, int], bytes]) -> Entry | None:
    """None when parts of a blob are missing."""
    if raw.type in NUMBERS:
        kind = NUMBERS[raw.type]
        return Entry(name, raw.key, kind, struct.unpack_from(FORMATS[kind], raw.data)[0])
    if raw.type == TEXT:
        return Entry(name, raw.key, "string", raw.data.rstrip(b"\0").decode("utf-8", "replace"))
    if raw.type == BLOB_V1:
        return Entry(name, raw.key, "blob", raw.data)
    if raw.type != BLOB_INDEX:
        return None
    size, count, first = struct.unpack_from("<IBB", raw.data)
    parts = [chunks.get((raw.namespace, raw.key, first + n)) for n in range(count)]
    whole = b"".join(part for part in parts if part is not None)
    return Entry(name, raw.key, "blob", whole) if len(whole) == size and None not in parts else None


def _crc(data: bytes) -> int:
    """As the chip's ROM computes it."""
    return zlib.crc32(data, 0xFFFFFFFF)
