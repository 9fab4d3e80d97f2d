"""Partition tables of ESP-IDF as bytes (its guide Partition Tables)."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator

from wificnc.firmware.flash.plan import Partition

ROW = struct.Struct("<HBBII16sI")
ROW_MAGIC, MD5_MAGIC = 0x50AA, 0xEBEB
TYPES = {0: "app", 1: "data"}
SUBTYPES = {"ota": 0, "phy": 1, "nvs": 2, "coredump": 3, "ota_0": 0x10, "ota_1": 0x11}  # those of partitions.csv


def table_bytes(text: str) -> bytes:
    """partitions.csv as the chip has it."""
    numbers = {name: number for number, name in TYPES.items()}
    table = b""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("#")[0].split(",")]
        if len(cells) >= 5:
            name, kind, subtype, offset, size = cells[:5]
            place = (int(offset, 0), int(size, 0))
            table += ROW.pack(ROW_MAGIC, numbers[kind], SUBTYPES[subtype], *place, name.encode(), 0)
    return table + struct.pack("<H", MD5_MAGIC) + b"\xff" * 14 + hashlib.md5(table).digest()


def table_rows(table: bytes) -> Iterator[Partition]:
    """Up to the first row that is none; the digest is not looked at."""
    for at in range(0, len(table) - ROW.size + 1, ROW.size):
        magic, kind, _, offset, size, name, _ = ROW.unpack_from(table, at)
        if magic != ROW_MAGIC:
            return
        yield Partition(name.rstrip(b"\0").decode("ascii", "replace"), TYPES.get(kind, "?"), offset, size)
