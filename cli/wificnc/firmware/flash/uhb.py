"""MikroE's USB HID bootloader (UHB), as the PIC32MZ board has it: our end of its protocol.

Known from the comment at the head of MikroElektronika's own UHB_Driver.c (2011) and its code for this board (Clicker 2
for PIC32MZ: Config.c, UHB_Driver.c), and from what pic32prog does, which agree. Packets have 64 bytes, numbers are
little-endian, addresses physical:

    host    0F 02                    INFO: answered by a record of 56 bytes, and only before BOOT
            0F 03                    BOOT: 0F 03; else the board starts its program a few seconds after a reset
            0F 01                    SYNC: 0F 01, and only after BOOT
            0F 15 address32 count16  ERASE so many pages of 16 KB, this one and those below it: 0F 15 when it is done
            0F 0B address32 count16  WRITE: packets of data follow, 0F 0B for each page and at the end
            0F 04                    REBOOT: no answer

What is written to the bootloader or to configuration words is acknowledged and not done; nothing can be read back, so
nothing is verified but that each page was acknowledged. The bootloader owns the reset vector at 0x1FC00000. It starts
the program by running 16 bytes right below itself: the program's own reset vector goes there. We never touch boot
flash: a power cut between its erasing and its writing would cost the bootloader.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from wificnc.build.image import Block
from wificnc.errors import FlashError

VENDOR, PRODUCT = 0x1234, 0x0001
PACKET, STX = 64, 0x0F
SYNC, INFO, BOOT, REBOOT, WRITE, ERASE = 1, 2, 3, 4, 11, 21
ANSWER_S = 5.0
PAGE = 0x4000
FAMILY_PIC32MZ = 21
FLASH, FLASH_SIZE = 0x1D00_0000, 0x20_0000
BOOTLOADER = 0x1D1F_4000
VECTOR_SIZE = 16
VECTOR_PLACE = BOOTLOADER - VECTOR_SIZE
RESET_VECTOR, CONFIG_WORDS = 0x1FC0_0000, 0x1FC0_FFC0
STORE, STORE_END = 0x1D18_0000, 0x1D18_C000  # the settings' three pages (targets/pic32mz/chip/pic32mz.ld)

RETRY_HINT = "the board has no program now: reset it and run the same command again"
START_HINT = "connect the board by USB and reset it: the bootloader waits a few seconds for a connection"

Progress = Callable[[str, int, int], None]  # what, bytes done, of bytes


class Wire(Protocol):
    """The HID interface, one packet at a time."""

    def write(self, packet: bytes) -> None:
        """Raises OSError when the board is gone."""

    def read(self, seconds: float) -> bytes:
        """A packet, or b"" when none has come. Raises OSError when the board is gone."""


@dataclass(frozen=True)
class Record:
    """What a bootloader says of its board."""

    family: int
    flash_bytes: int
    page_bytes: int
    row_bytes: int
    version: int
    bootloader: int  # physical address
    name: str


@dataclass(frozen=True)
class Page:
    """16 KB to be erased and written."""

    address: int
    data: bytes


def plan_pages(image: Iterable[Block]) -> list[Page]:
    """Program pages in order, the one with the start vector last. Raises FlashError for an image that cannot be
    written this way."""
    pages: dict[int, bytearray] = {}
    vector = b""
    for block in image:
        if block.address == RESET_VECTOR and len(block.data) == VECTOR_SIZE:
            vector = block.data
        elif not (CONFIG_WORDS <= block.address < CONFIG_WORDS + 0x40):
            _check_place(block)
            _fill(pages, block)
    if not vector:
        raise FlashError(
            f"the image's reset vector is not {VECTOR_SIZE} bytes at {RESET_VECTOR:#x}",
            hint="the bootloader has no place for another one; a programmer can write this image",
        )
    ordered = [Page(address, bytes(data)) for address, data in sorted(pages.items())]
    last = bytes([0xFF]) * (PAGE - VECTOR_SIZE) + vector
    return [*ordered, Page(BOOTLOADER - PAGE, last)]


def _check_place(block: Block) -> None:
    """Raises FlashError."""
    free = [(FLASH, STORE), (STORE_END, BOOTLOADER - PAGE)]
    if not any(low <= block.address and block.end <= high for low, high in free):
        raise FlashError(
            f"the image has bytes at {block.address:#x} to {block.end:#x}",
            hint="the settings, the bootloader or the boot flash are there; nothing has been written",
        )


def _fill(pages: dict[int, bytearray], block: Block) -> None:
    for offset, byte in enumerate(block.data):
        address = block.address + offset
        page = pages.setdefault(address & ~(PAGE - 1), bytearray(b"\xff" * PAGE))
        page[address & (PAGE - 1)] = byte


class Bootloader:
    """One that waits at the other end. Every method raises FlashError when it does not answer as it should."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire

    def info(self) -> Record:
        self._send(_command(INFO), "identifying it")
        said = self._hear("identifying it", START_HINT)
        tags = [said[at] for at in (1, 4, 12, 16, 20, 24, 32)]
        if said[0] != 56 or tags != [1, 8, 3, 4, 5, 6, 7]:
            raise FlashError("not a MikroE bootloader: its record has another format", hint="nothing was written")
        name = said[33:53].split(b"\0")[0].decode("ascii", "replace")
        flash, (page,), (row,) = _u32(said, 8), struct.unpack_from("<H", said, 14), struct.unpack_from("<H", said, 18)
        version = struct.unpack_from("<H", said, 22)[0]
        return Record(said[2], flash, page, row, version, _u32(said, 28) & 0x1FFFFFFF, name)

    def enter(self) -> None:
        """Stay in the bootloader."""
        for code in (BOOT, SYNC):
            self._ask(_command(code), code, "entering the bootloader", START_HINT)

    def erase(self, address: int) -> None:
        """One page."""
        self._ask(_command(ERASE, address, 1), ERASE, f"erasing {address:#x}", RETRY_HINT)

    def write(self, page: Page) -> None:
        what = f"writing {page.address:#x}"
        self._send(_command(WRITE, page.address, len(page.data)), what)
        for at in range(0, len(page.data), PACKET):
            self._send(page.data[at : at + PACKET], what)
        self._expect(WRITE, what, RETRY_HINT)

    def reboot(self) -> None:
        self._send(_command(REBOOT), "starting the program")

    def _ask(self, packet: bytes, code: int, what: str, hint: str) -> None:
        self._send(packet, what)
        self._expect(code, what, hint)

    def _expect(self, code: int, what: str, hint: str) -> None:
        said = self._hear(what, hint)
        if said[:2] != bytes([STX, code]):
            raise FlashError(f"the bootloader answers {said[:2].hex()} when {what}", hint=hint)

    def _send(self, packet: bytes, what: str) -> None:
        try:
            self._wire.write(packet)
        except OSError as err:
            raise FlashError(f"the connection to the board was lost while {what}: {err}", hint=RETRY_HINT) from err

    def _hear(self, what: str, hint: str) -> bytes:
        try:
            said = self._wire.read(ANSWER_S)
        except OSError as err:
            raise FlashError(f"the connection to the board was lost while {what}: {err}", hint=hint) from err
        if len(said) != PACKET:
            raise FlashError(f"the bootloader does not answer when {what}", hint=hint)
        return said


def check_record(record: Record) -> None:
    """Raises FlashError for any board but the one that the image is for."""
    wanted = {
        "family": (record.family, FAMILY_PIC32MZ),
        "flash": (record.flash_bytes, FLASH_SIZE),
        "page": (record.page_bytes, PAGE),
        "bootloader's address": (record.bootloader, BOOTLOADER),
    }
    wrong = [f"{what} {found:#x} and not {want:#x}" for what, (found, want) in wanted.items() if found != want]
    if not wrong and (record.row_bytes == 0 or PAGE % record.row_bytes != 0):
        wrong = [f"rows of {record.row_bytes} bytes"]
    if wrong:
        raise FlashError(
            f"{record.name or 'this board'} is not the board of this image: {', '.join(wrong)}",
            hint="nothing has been written",
        )


def flash(wire: Wire, pages: list[Page], progress: Progress) -> Record:
    """Erase and write. The page with the start vector is erased first and written last: what stops in the middle does
    not run. Raises FlashError."""
    device = Bootloader(wire)
    record = device.info()
    check_record(record)
    device.enter()
    total = sum(len(page.data) for page in pages)
    for page in reversed(pages):
        device.erase(page.address)
    for number, page in enumerate(pages):
        device.write(page)
        progress("program", (number + 1) * PAGE, total)
    device.reboot()
    return record


def describe(pages: list[Page]) -> list[str]:
    """What would be done."""
    lines = [f"erase 0x{page.address:08X}  {len(page.data):,} bytes" for page in reversed(pages)]
    lines += [f"write 0x{page.address:08X}  {len(page.data):,} bytes" for page in pages]
    lines[-1] += f", the start vector at 0x{VECTOR_PLACE:08X}"
    kept = (
        "the settings, the bootloader, boot flash and the configuration words "
        "(the bootloader's own words must be the same)"
    )
    return [*lines, f"untouched: {kept}"]


def _command(code: int, address: int = 0, count: int = 0) -> bytes:
    return struct.pack("<BBIH", STX, code, address, count).ljust(PACKET, b"\0")


def _u32(data: bytes, at: int) -> int:
    return int(struct.unpack_from("<I", data, at)[0])


# ---- the wire: PyPI's hidapi ----


class HidWire:
    """The first such bootloader that is plugged in, from `with` until it ends. Raises FlashError."""

    def __enter__(self) -> HidWire:
        try:
            import hid
        except ImportError as err:
            raise FlashError("hidapi is not installed", hint="pip install hidapi") from err
        self._device: Any = hid.device()
        try:
            self._device.open(VENDOR, PRODUCT)
        except OSError as err:
            raise FlashError(f"no MikroE bootloader is connected: {err}", hint=START_HINT) from err
        return self

    def __exit__(self, *_: object) -> None:
        self._device.close()

    def write(self, packet: bytes) -> None:
        if self._device.write(b"\0" + packet) < 0:  # reports have no number
            raise OSError(self._device.error())

    def read(self, seconds: float) -> bytes:
        return bytes(self._device.read(PACKET, round(seconds * 1000)))
