"""Images of ESP-IDF, byte by byte: https://docs.espressif.com/projects/esptool, Firmware Image Format; ESP-IDF's guides
Partition Tables, Over The Air Updates."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Iterable

BOOTLOADER_AT = (0x1000, 0)  # by enum es_chip
BOOTLOADER_CODE = (0x40080000, 0x403C0000)
CHIP_IDS = (0, 9)
TABLE_AT, OTADATA_AT, OTA_0, OTA_1, SLOT = 0x8000, 0xF000, 0x20000, 0x200000, 0x1E0000
NEW, PENDING, VALID, INVALID, ABORTED, UNDEFINED = 0, 1, 2, 3, 4, 0xFFFFFFFF


def image(
    entry: int, pieces: Iterable[tuple[int, bytes]], *, chip: int = 0, hashed: bool = True, flash_size: int = 2
) -> bytes:
    """As esptool makes one. @param flash_size  its code: 2 is 4 MB"""
    pieces = list(pieces)
    mode = flash_size << 4
    text = struct.pack("<4BI4BHBHH4xB", 0xE9, len(pieces), 2, mode, entry, 0xEE, 0, 0, 0, chip, 0, 0, 0, hashed)
    checksum = 0xEF
    for address, data in pieces:
        text += struct.pack("<2I", address, len(data)) + data
        for byte in data:
            checksum ^= byte
    text += bytes(15 - len(text) % 16) + bytes((checksum,))
    return text + (hashlib.sha256(text).digest() if hashed else b"")


def mapped(flash_piece: tuple[int, bytes], at: int = 24) -> list[tuple[int, bytes]]:
    """A segment for flash, after padding that puts it where a page of 64 KB can map it.
    @param at  the place in the image"""
    padding = (flash_piece[0] - (at + 16)) % 0x10000
    return [(0, bytes(padding)), flash_piece]


def partition(kind: int, subtype: int, at: int, size: int, label: bytes, flags: int = 0) -> bytes:
    return struct.pack("<H2B2I16sI", 0x50AA, kind, subtype, at, size, label, flags)


# That of targets/esp32/partitions.csv.
TABLE = (
    partition(1, 2, 0x9000, 0x6000, b"nvs"),
    partition(1, 0, OTADATA_AT, 0x2000, b"otadata"),
    partition(0, 0x10, OTA_0, SLOT, b"ota_0"),
    partition(0, 0x11, OTA_1, SLOT, b"ota_1"),
)


def table(entries: Iterable[bytes] = TABLE) -> bytes:
    text = b"".join(entries)
    return text + b"\xeb\xeb" + b"\xff" * 14 + hashlib.md5(text).digest()


def otadata(sequence: int, state: int = UNDEFINED) -> bytes:
    """One entry of the two."""
    number = struct.pack("<I", sequence)
    # esp_rom_crc32_le(UINT32_MAX, ...): CRC-32 whose register starts with 0
    crc = zlib.crc32(number, 0xFFFFFFFF)
    return number + b"\xff" * 20 + struct.pack("<2I", state, crc)


def merged(kind: int, app: bytes, *, parts: bytes | None = None, more: Iterable[tuple[int, bytes]] = ()) -> bytes:
    """A bootloader that is never run, the table, the application in ota_0."""
    code = BOOTLOADER_CODE[kind]
    flash = bytearray(b"\xff" * (OTA_0 + len(app)))
    bootloader = image(code, [(code, bytes(16))], chip=CHIP_IDS[kind])
    for at, data in (
        (BOOTLOADER_AT[kind], bootloader),
        (TABLE_AT, table() if parts is None else parts),
        (OTA_0, app),
        *more,
    ):
        flash += b"\xff" * (at + len(data) - len(flash))
        flash[at : at + len(data)] = data
    return bytes(flash)
