"""What `--on-chip IMAGE` may be for a board with an ESP32: the flash chip that it makes, and the names of functions."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass
from pathlib import Path

from wificnc.board import paths
from wificnc.board.model import Board
from wificnc.errors import BuildError, UserError
from wificnc.files.bounded import IMAGE_MAX, read_bytes
from wificnc.firmware.flash.partitions import table_bytes, table_rows
from wificnc.firmware.flash.plan import (
    APP_MAGIC,
    BOOTLOADER_AT,
    CHIP_IDS,
    IMAGE_MAGIC,
    PARTITION_TABLE_AT,
    PROJECT,
    image_flash_mb,
    load_regions,
    read_partitions,
)

HEADER, SEGMENT_HEADER = 24, 8
DESCRIPTION = 32  # esp_app_desc_t, at the beginning of the first segment
PROJECT_AT, ELF_HASH_AT, HASH = 48, 144, 32  # in it
RADIO_MARK = b"WiFiCNC radio 1\0"  # targets/esp32/net/wifi.c; behind it the address of esp_wifi_init
OTHERS = (
    (b"\x7fELF", "an ELF file", "name the .bin next to it; the names of functions are taken from the ELF file"),
    (b"UF2\n", "a UF2 file, for an ESP USB Bridge", "name the -merged.bin next to it"),
    (b"PK", "an archive", "unpack it first"),
    (b"\x1f\x8b", "an archive", "unpack it first"),
    (b":", "an Intel HEX file, as of a PIC32MZ", "an image of an ESP32 is a .bin"),
    (b"\xaa\x50", "a partition table alone", "name the folder of the build, its merged image or its firmware.bin"),
)


@dataclass(frozen=True)
class EspImage:
    """A flash chip's content, and where it came from."""

    path: Path
    flash: bytes
    flash_size: int
    has_bootloader: bool  # a merged image, which is checked whole
    nvs: tuple[int, int]  # where the settings are: offset, size
    elf: bytes | None  # of this very image
    wifi_init: int | None  # address of esp_wifi_init; None: by its name in the ELF file, if at all


def load_image(path: Path, board: Board) -> EspImage:
    """A folder of `wificnc build`, a merged image or an application. What is in it is checked when it starts.

    Raises:
        UserError: it cannot run in the virtual chip, and why.
    """
    _check_board(board)
    if path.is_dir():
        return _from_folder(path, board)
    try:
        data = read_bytes(path, IMAGE_MAX)
    except OSError as err:
        hint = f"wificnc build {board.id}, then --on-chip build/{board.id}"
        raise UserError(f"cannot read the image {path}: {err.strerror}", hint=hint) from err
    if _has_table(data):
        return _merged(path, data, board)
    return _application(path, data, board)


def _check_board(board: Board) -> None:
    if board.target != "esp32":
        raise BuildError(f"board {board.id} has no image for the virtual ESP32")


def _from_folder(folder: Path, board: Board) -> EspImage:
    """build/BOARD, or what a package carries."""
    partitions = read_partitions(_partitions())
    flash = bytearray()
    for region in load_regions(folder, board, partitions):
        flash += b"\xff" * (region.end - len(flash))
        flash[region.offset : region.end] = region.data
    return _merged(folder, bytes(flash), board)


def _merged(path: Path, flash: bytes, board: Board) -> EspImage:
    header = flash[BOOTLOADER_AT[board.chip] :]
    rows = {row.name: row for row in table_rows(flash[PARTITION_TABLE_AT:])}
    app = next((row for row in rows.values() if row.type == "app"), None)
    nvs = rows.get("nvs")
    if app is None or nvs is None:
        raise UserError(f"{path}: its partition table has no {'nvs' if app else 'application'}: not a WiFiCNC image")
    if header[:1] == bytes((IMAGE_MAGIC,)) and flash[app.offset : app.offset + 1] == bytes((IMAGE_MAGIC,)):
        _check_project(path, flash[app.offset :], board)
        _check_end(path, flash[app.offset :], "its application")
    size = (image_flash_mb(header) or 4) << 20
    return EspImage(path, flash, size, True, (nvs.offset, nvs.size), *_names(path, flash[app.offset :]))


def _application(path: Path, data: bytes, board: Board) -> EspImage:
    """An application alone: our partition table, and it in the first slot. There is no bootloader, and none is run."""
    for begin, what, hint in OTHERS:
        if data.startswith(begin):
            raise UserError(f"{path} is {what}, not an image of an ESP32", hint=hint)
    if not data or data[0] != IMAGE_MAGIC:
        why = f"its first byte is {data[0]:02x}, not e9" if data else "it is empty"
        hint = f"an encrypted image cannot be run; `wificnc build {board.id}` makes one that can"
        raise UserError(f"{path} is not an image of an ESP32: {why}", hint=hint)
    _check_project(path, data, board)
    _check_end(path, data, "it")
    partitions = read_partitions(_partitions())
    slot, nvs = partitions["ota_0"], partitions["nvs"]
    flash = bytearray(b"\xff" * slot.offset)
    table = table_bytes(_partitions())
    flash[PARTITION_TABLE_AT : PARTITION_TABLE_AT + len(table)] = table
    if len(data) > slot.size:
        raise UserError(f"{path} has {len(data):,} bytes, its slot {slot.size:,}", hint="name a merged image whole")
    size = (image_flash_mb(data) or 4) << 20
    return EspImage(path, bytes(flash) + data, size, False, (nvs.offset, nvs.size), *_names(path, data))


def _check_project(path: Path, app: bytes, board: Board) -> None:
    """Whose it is; which chip's and whether it is whole is the virtual chip's business."""
    if len(app) < DESCRIPTION + ELF_HASH_AT + HASH:
        raise UserError(f"{path} is damaged: it ends after {len(app)} bytes", hint="build or download it again")
    chip, magic = struct.unpack_from("<H", app, 12)[0], struct.unpack_from("<I", app, DESCRIPTION)[0]
    project = app[DESCRIPTION + PROJECT_AT :][:32].split(b"\0")[0].decode("ascii", "replace")
    if magic != APP_MAGIC and chip == CHIP_IDS[board.chip]:
        raise UserError(
            f"{path} is not an application: it has no description, as a bootloader has none",
            hint="name the folder of the build, its merged image or its firmware.bin",
        )
    if magic == APP_MAGIC and project != PROJECT:
        raise UserError(f"{path} is not a WiFiCNC firmware, but {project!r}")


def _check_end(path: Path, app: bytes, what: str) -> None:
    """That it does not end in a segment: what follows in flash would be taken for the rest."""
    at, count = HEADER, app[1]
    for number in range(1, count + 1):
        end = at + SEGMENT_HEADER + (struct.unpack_from("<I", app, at + 4)[0] if at + SEGMENT_HEADER <= len(app) else 0)
        if end > len(app):
            where = f"in segment {number} of {count}"
            raise UserError(
                f"{path} is damaged: {what} ends after {len(app)} bytes, {where}", hint="build or download it again"
            )
        at = end


def _partitions() -> str:
    return (paths.TARGETS / "esp32" / "partitions.csv").read_text(encoding="utf-8")


def _has_table(flash: bytes) -> bool:
    return next(table_rows(flash[PARTITION_TABLE_AT:]), None) is not None


# ---- names of functions ----


def _names(path: Path, app: bytes) -> tuple[bytes | None, int | None]:
    """The ELF file of this application, by the hash that the application has of it; and the radio's mark."""
    at = app.find(RADIO_MARK)
    address = at + len(RADIO_MARK)
    wifi_init = struct.unpack_from("<I", app, address)[0] if at >= 0 and address + 4 <= len(app) else None
    wanted = app[DESCRIPTION + ELF_HASH_AT :][:HASH]
    folder = path if path.is_dir() else path.parent
    for candidate in sorted(path for path in folder.glob("*.elf") if path.is_file()):
        elf = candidate.read_bytes()
        if hashlib.sha256(elf).digest() == wanted:
            return elf, wifi_init
    return None, wifi_init
