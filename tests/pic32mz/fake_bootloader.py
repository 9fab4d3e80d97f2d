"""The board's end of MikroE's USB HID bootloader, written down from what its firmware does (UHB_Driver.c, Config.c)
and not from our program: commands of a packet, a buffer of a page; what it refuses it acknowledges all the same."""

from __future__ import annotations

import struct

FLASH, BOOT_FLASH = 0x1D000000, 0x1FC00000
START = 0x1D1F4000
PAGE, ROW = 0x4000, 0x800


class FakeBootloader:
    """wificnc.firmware.flash.uhb.Wire. Flash is erased by pages and written by rows, once."""

    def __init__(self, family: int = 21, flash_bytes: int = 0x200000, start: int = START, page: int = PAGE) -> None:
        self.flash = bytearray(b"\xff" * 0x200000)
        self.boot_flash = bytearray(b"\xff" * 0x10000)
        self.reboots = 0
        self.refused: list[int] = []  # addresses that it keeps to itself
        self.twice: list[int] = []  # rows that were not erased
        self.erased: list[int] = []
        self.packets_until_lost: int | None = None
        self.deaf_to: int | None = None
        self._family, self._size, self._start, self._page = family, flash_bytes, start, page
        self._answers: list[bytes] = []
        self.reset()

    def reset(self) -> None:
        """Its first seconds: it waits for INFO and BOOT, and anything else blocks it until the next reset."""
        self._in_loader = self._stuck = False
        self._left = self._address = 0
        self._buffer = b""
        self._answers = []

    # --- the wire ---

    def write(self, packet: bytes) -> None:
        assert len(packet) == 64
        if self.packets_until_lost is not None:
            if self.packets_until_lost == 0:
                raise OSError("no such device")
            self.packets_until_lost -= 1
        if self._left > 0:
            self._data(packet)
        elif packet[0] == 0x0F and packet[1] != self.deaf_to and not self._stuck:
            self._command(packet)

    def read(self, seconds: float) -> bytes:
        if self.packets_until_lost == 0:
            raise OSError("no such device")
        return self._answers.pop(0) if self._answers else b""

    # --- inside ---

    def _acknowledge(self, code: int) -> None:
        self._answers.append(bytes([0x0F, code]).ljust(64, b"\0"))

    def _command(self, packet: bytes) -> None:
        code, address, count = packet[1], *struct.unpack_from("<IH", packet, 2)
        if not self._in_loader:
            if code == 2:
                self._answers.append(self._record())
            elif code == 3:
                self._in_loader = True
                self._acknowledge(code)
            else:
                self._stuck = True
        elif code == 1:
            self._acknowledge(code)
        elif code == 4:
            self.reboots += 1
            self.reset()
        elif code == 21:
            for block in range(count):
                self._erase(address - block * PAGE)
            self._acknowledge(code)
        elif code == 11:
            self._left, self._address, self._buffer = count, address, b""

    def _record(self) -> bytes:
        record = struct.pack("<BBBxB3xI", 56, 1, self._family, 8, self._size)
        record += struct.pack("<BxHBxHBxH", 3, self._page, 4, ROW, 5, 0x1200)
        record += struct.pack("<B3xIB20s", 6, self._start | 0xA0000000, 7, b"Clicker2MZ")
        return record.ljust(64, b"\0")

    def _data(self, packet: bytes) -> None:
        taken = packet[: self._left]
        self._buffer += taken
        self._left -= len(taken)
        if len(self._buffer) == PAGE or self._left == 0:
            for at in range(0, len(self._buffer), ROW):
                self._row(self._address + at, self._buffer[at : at + ROW])
            self._address += len(self._buffer)
            self._buffer = b""
            self._acknowledge(11)

    def _place(self, address: int) -> tuple[bytearray, int] | None:
        if FLASH <= address < START:
            return self.flash, address - FLASH
        if BOOT_FLASH <= address < BOOT_FLASH + 0xFF00:
            return self.boot_flash, address - BOOT_FLASH
        self.refused.append(address)
        return None

    def _erase(self, address: int) -> None:
        if place := self._place(address):
            memory, at = place
            at -= at % PAGE
            memory[at : at + PAGE] = b"\xff" * PAGE
            self.erased.append(address)

    def _row(self, address: int, data: bytes) -> None:
        if place := self._place(address):
            memory, at = place
            assert at % ROW == 0 and len(data) == ROW
            if memory[at : at + ROW] != b"\xff" * ROW:
                self.twice.append(address)
            memory[at : at + ROW] = data
