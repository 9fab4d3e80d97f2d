"""An ESP32 board's firmware, checked and in the forms that people flash. esptool reads and merges the images."""

from __future__ import annotations

import hashlib
import struct
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.model import Board
from wificnc.build.esp32 import SIGNATURE
from wificnc.build.signing import VARIABLE, signing_key
from wificnc.errors import ReleaseError
from wificnc.firmware.flash.device import quiet_esptool
from wificnc.firmware.flash.partitions import MD5_MAGIC, ROW, table_rows
from wificnc.firmware.flash.plan import BOOTLOADER, FIRMWARE, Partition, Region, image_flash_mb, load_regions

IMPROV_MAGIC = b"IMPROV"  # begins every packet of Improv's serial protocol


@dataclass(frozen=True)
class Esp32Firmware:
    """One build of one board."""

    regions: tuple[Region, ...]  # all that a flash writes; never the settings (NVS)
    merged: bytes  # of one piece, from address 0; between the regions it is blank, so it forgets the settings
    uf2: bytes  # the regions, for an ESP USB Bridge
    elf: bytes
    signature: bytes  # of the firmware, in DER
    flash_mb: int  # that it needs
    has_improv: bool  # WiFi can be set over the serial port


def load_firmware(folder: Path, board: Board, partitions: dict[str, Partition]) -> Esp32Firmware:
    """Read build/BOARD and check all of it. Raises FlashError or ReleaseError: a part is missing, damaged, of another
    chip or board, or does not fit."""
    regions = tuple(load_regions(folder, board, partitions))
    by_name = {region.name: region.data for region in regions}
    for name in (BOOTLOADER, FIRMWARE):
        _check_image(name, by_name[name], board)
    signature = _signature(folder / SIGNATURE, by_name[FIRMWARE], board)
    _check_table(folder / "partitions.bin", partitions)
    flash_mb = image_flash_mb(by_name[BOOTLOADER])
    _check_flash(flash_mb, board)
    return Esp32Firmware(
        regions=regions,
        merged=_merge(regions, board.chip, "raw"),
        uf2=_merge(regions, board.chip, "uf2"),
        elf=(folder / "firmware.elf").read_bytes(),
        signature=signature,
        flash_mb=flash_mb,
        has_improv=IMPROV_MAGIC in by_name[FIRMWARE],
    )


def _check_flash(flash_mb: int, board: Board) -> None:
    """The firmware fits all boards that are sold. Raises ReleaseError."""
    if not board.memory.flash_mb:
        raise ReleaseError(
            f"the board file of {board.id} names no flash sizes",
            hint="memory.flash_mb lists what the board is sold with, such as [4, 8]",
        )
    smallest = min(board.memory.flash_mb)
    if flash_mb > smallest:
        raise ReleaseError(
            f"the bootloader of {board.id} was built for {flash_mb} MB of flash, and there are boards with "
            f"{smallest} MB",
            hint="CONFIG_ESPTOOLPY_FLASHSIZE in targets/esp32/sdkconfig.defaults",
        )


def _check_image(name: str, data: bytes, board: Board) -> None:
    """Segments, checksum and digest. Raises ReleaseError."""
    hint = f"wificnc build {board.id} --clean"
    esptool = quiet_esptool()
    try:
        image = esptool.bin_image.LoadFirmwareImage(board.chip, data)
        found, wanted = image.calculate_checksum(), image.checksum
    except (esptool.FatalError, struct.error, IndexError) as err:
        raise ReleaseError(f"the {name} of {board.id} is incomplete: {err}", hint) from err
    if found != wanted:
        raise ReleaseError(f"the {name} of {board.id} is damaged: its checksum is {found}, not {wanted}", hint)
    if not image.append_digest or image.stored_digest != image.calc_digest:
        raise ReleaseError(f"the {name} of {board.id} is damaged: its SHA-256 is missing or differs", hint)


def _signature(path: Path, firmware: bytes, board: Board) -> bytes:
    """Every board of a release takes the updates of the next one. Raises ReleaseError."""
    key = signing_key()
    signature = path.read_bytes() if path.is_file() else b""
    if key.point not in firmware or not key.has_signed(firmware, signature):
        raise ReleaseError(
            f"the firmware of {board.id} is not signed with the key {key.name}",
            hint=f"set {VARIABLE} to the key it was built with; or wificnc build {board.id} --clean",
        )
    return signature


def read_table(data: bytes) -> list[Partition]:
    """A binary partition table, whose digest must be right. Raises ReleaseError."""
    rows = list(table_rows(data))
    end = len(rows) * ROW.size
    if len(data) >= end + ROW.size and int.from_bytes(data[end : end + 2], "little") == MD5_MAGIC:
        if hashlib.md5(data[:end]).digest() != data[end + 16 : end + 32]:
            raise ReleaseError("the partition table is damaged: its MD5 differs")
        return rows
    raise ReleaseError("the partition table is invalid: its MD5 entry is missing")


def _check_table(path: Path, partitions: dict[str, Partition]) -> None:
    """The chip must see what we write to. Raises ReleaseError."""
    if read_table(path.read_bytes()) != sorted(partitions.values(), key=lambda row: row.offset):
        raise ReleaseError(
            f"{path} is not the table of targets/esp32/partitions.csv", hint="build again: the table has changed"
        )


def _merge(regions: Sequence[Region], chip: str, form: str) -> bytes:
    """By esptool, which writes UF2 only to files."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "merged"
        pieces = [(region.offset, region.data) for region in regions]
        quiet_esptool().cmds.merge_bin(pieces, chip, output=str(output), format=form)
        return output.read_bytes()
