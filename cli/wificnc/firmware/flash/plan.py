"""What will be written where, and whether this image and this chip belong together. Pure."""

from __future__ import annotations

import hashlib
import re
import struct
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.load import find_boards
from wificnc.board.model import Board
from wificnc.errors import FlashError
from wificnc.files.bounded import IMAGE_MAX, read_bytes
from wificnc.files.jsonfile import read_json

# Chip ids of images (ESP-IDF, esp_app_format.h), and where their first loader looks for the second one.
CHIP_IDS = {"esp32": 0, "esp32s3": 9}
CHIP_FAMILIES = {"esp32": "ESP32", "esp32s3": "ESP32-S3"}  # as browsers' flashers call them
BOOTLOADER_AT = {"esp32": 0x1000, "esp32s3": 0x0}
PARTITION_TABLE_AT = 0x8000
IMAGE_MAGIC = 0xE9
APP_MAGIC = 0xABCD5432
PROJECT = "wificnc"
BOARD_MARK = re.compile(rb'"board": "([a-z0-9-]{1,47})"')  # targets/esp32/net/page.c
BOOTLOADER, TABLE, SLOT_CHOICE, FIRMWARE = "bootloader", "partition table", "slot choice", "firmware"  # of regions
FLASH_MB = (1, 2, 4, 8, 16, 32, 64, 128)  # of the upper half of header byte 3
OCTAL_PSRAM_MB = 8  # embedded PSRAM of this size or more is octal


@dataclass(frozen=True)
class Partition:
    """A row of partitions.csv, bytes."""

    name: str
    type: str
    offset: int
    size: int


@dataclass(frozen=True)
class Region:
    """Bytes and where they go."""

    name: str
    offset: int
    data: bytes

    @property
    def end(self) -> int:
        return self.offset + len(self.data)


@dataclass(frozen=True)
class Chip:
    """What is connected."""

    name: str  # esp32, esp32s3
    title: str  # "ESP32-S3 (QFN56)"
    revision: str  # "v0.2"
    flash_mb: float
    psram_mb: int  # in the chip; 0: none, or it cannot be told
    psram_1v8: bool
    mac: str


def read_partitions(text: str) -> dict[str, Partition]:
    """partitions.csv. Raises FlashError."""
    found = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("#")[0].split(",")]
        if len(cells) < 5:
            continue
        try:
            found[cells[0]] = Partition(cells[0], cells[1], int(cells[3], 0), int(cells[4], 0))
        except ValueError as err:
            raise FlashError(f"the partition table has an invalid line: {line}") from err
    return found


def flash_needed_mb(partitions: dict[str, Partition]) -> float:
    """Up to the end of the last partition."""
    return max(row.offset + row.size for row in partitions.values()) / (1 << 20)


def load_regions(folder: Path, board: Board, partitions: dict[str, Partition]) -> list[Region]:
    """What a full flash writes, of the artefacts of build/BOARD. Settings (NVS) are no part of it.

    Raises FlashError when there is no build, it is damaged, or of another board.
    """
    _check_build(folder, board)
    slot = partitions["ota_0"]
    regions = [
        Region(BOOTLOADER, BOOTLOADER_AT[board.chip], _image(folder / "bootloader.bin", board.chip)),
        Region(TABLE, PARTITION_TABLE_AT, (folder / "partitions.bin").read_bytes()),
        # blank: the first slot starts
        Region(SLOT_CHOICE, partitions["otadata"].offset, b"\xff" * partitions["otadata"].size),
        Region(FIRMWARE, slot.offset, app_image(folder / "firmware.bin", board.chip)),
    ]
    made = board_of(regions[-1].data)
    if made not in (None, board.id):
        raise FlashError(
            f"{folder / 'firmware.bin'} is for the board {made}, not for {board.id}",
            hint=f"its build.json is of another build: `wificnc build {board.id}`, or `wificnc flash {made}`",
        )
    if regions[-1].end > slot.offset + slot.size:
        raise FlashError(f"the firmware has {len(regions[-1].data):,} bytes, its slot {slot.size:,}")
    return regions


def app_image(path: Path, chip: str) -> bytes:
    """A firmware of ours for this chip. Raises FlashError for anything else."""
    data = _image(path, chip)
    magic, project = struct.unpack_from("<I44x32s", data, 32)
    if magic != APP_MAGIC or project.rstrip(b"\0") != PROJECT.encode():
        raise FlashError(f"{path} is not a WiFiCNC firmware")
    return data


def board_of(image: bytes) -> str | None:
    """The board that a firmware is for, as it tells its page; None: it tells none."""
    found = BOARD_MARK.search(image)
    return found[1].decode() if found else None


def _check_build(folder: Path, board: Board) -> None:
    hint = f"wificnc build {board.id}"
    record_path = folder / "build.json"
    if not record_path.is_file():
        raise FlashError(f"no build found for {board.id} in {folder}", hint=hint)
    try:
        record = read_json(record_path)
        sums = {row["name"]: row["sha256"] for row in record["artefacts"]}
        if record["board"] != board.id:
            raise FlashError(f"{record_path} is a build of {record['board']}, not of {board.id}", hint=hint)
        for name, wanted in sums.items():
            if hashlib.sha256((folder / name).read_bytes()).hexdigest() != wanted:
                raise FlashError(f"{folder / name} differs from the build record", hint=hint)
    except OSError as err:
        name = Path(str(err.filename)).name
        why = f"cannot read {name}: {err.strerror}"
        raise FlashError(f"the build in {folder} is incomplete: {why}", hint=hint) from err
    except (ValueError, KeyError, TypeError) as err:
        why = f"{record_path.name} is damaged: not the record of a build"
        raise FlashError(f"the build in {folder} is incomplete: {why}", hint=hint) from err


def _image(path: Path, chip: str) -> bytes:
    """An image whose head and checksums are right. Raises FlashError."""
    data = read_bytes(path, IMAGE_MAX)
    if len(data) < 112 or data[0] != IMAGE_MAGIC:
        raise FlashError(f"{path} is not an ESP32 image")
    (chip_id,) = struct.unpack_from("<H", data, 12)
    if chip_id != CHIP_IDS[chip]:
        names = {number: name for name, number in CHIP_IDS.items()}
        raise FlashError(f"{path} is for {names.get(chip_id, f'chip {chip_id}')}, not for {chip}")
    if data[23] and hashlib.sha256(data[:-32]).digest() != data[-32:]:
        raise FlashError(f"{path} is damaged: its SHA-256 differs")
    return data


def image_flash_mb(bootloader: bytes) -> int:
    """The flash that a bootloader was built for."""
    return FLASH_MB[data_size] if (data_size := bootloader[3] >> 4) < len(FLASH_MB) else 0


def check_chip(chip: Chip, board: Board, regions: list[Region], partitions: dict[str, Partition]) -> list[str]:
    """Before anything is written: whether this chip is the board's. @return warnings. Raises FlashError."""
    check_model(chip, board)
    bootloader = next((region.data for region in regions if region.name == BOOTLOADER), None)
    needed_mb = max(flash_needed_mb(partitions), image_flash_mb(bootloader) if bootloader else 0)
    if chip.flash_mb < needed_mb:
        raise FlashError(f"this chip has {chip.flash_mb:g} MB of flash, and this firmware needs {needed_mb:g} MB")
    for region in regions:
        if region.end > chip.flash_mb * (1 << 20):
            raise FlashError(f"{region.name} ends at {region.end / (1 << 20):.1f} MB, beyond {chip.flash_mb:g} MB")
    return _check_memory(chip, board)


def check_model(chip: Chip, board: Board) -> None:
    """Raises FlashError: another one than the board's."""
    if chip.name != board.chip:
        raise FlashError(
            f"this is an {chip.title}, and {board.id} has an {board.pins.name}",
            hint="`wificnc boards` lists the boards; is another board connected, too?",
        )


def _check_memory(chip: Chip, board: Board) -> list[str]:
    """Memory takes pins that a board for less of it may use."""
    octal = chip.psram_mb >= OCTAL_PSRAM_MB
    if chip.psram_1v8 and board.memory.mode != "octal-1v8":
        raise FlashError(f"this module's memory runs at 1.8 V, and so do its GPIO47 and 48: not a board {board.id}")
    if chip.psram_mb and board.memory.mode == "flash":
        raise FlashError(f"this module has PSRAM, which takes pins; {board.id} is for a module without one")
    if octal and board.memory.mode == "quad":
        hint = "wificnc flash esp32s3-devkitc" if board.id == "esp32s3-devkitc-quad" else None
        raise FlashError(f"this module has octal PSRAM, which takes GPIO33 to 37; {board.id} is for quad memory", hint)
    other = f"{board.id}-quad"
    if not octal and board.memory.mode == "octal" and other in {path.stem for path in find_boards()}:
        return [f"no octal PSRAM in this module: {other} would give you more pins"]
    return []
