"""SPI2 and SPI3 as ESP-IDF's spi_master drives them for the W5500: 16 bits of command, 8 of address, then data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from registers import Registers

DUPLEX, HAS_OUT, HAS_IN, HAS_ADDRESS, HAS_COMMAND = 1 << 0, 1 << 27, 1 << 28, 1 << 30, 1 << 31
CYCLES_OF_BIT = 12  # 20 MHz
PIECE = 1024  # of a list


@dataclass
class Bus:
    """Of the ESP32: DMA of its own, one length each way, the end in SLAVE."""

    regs: Registers
    host: int
    by_dma: bool

    BASE: ClassVar = {2: 0x3FF64000, 3: 0x3FF65000}
    SELECT0: ClassVar = {2: 11, 3: 68}
    SOURCE: ClassVar = {2: 30, 3: 31}
    CMD, ADDRESS, CLOCK, USER, USER1, USER2 = 0x00, 0x04, 0x18, 0x1C, 0x20, 0x24
    OUT_BITS, IN_BITS, SLAVE, BUFFER = 0x28, 0x2C, 0x38, 0x80
    START, DONE, DONE_ENABLED, SLAVE_MODE = 1 << 18, 1 << 4, 1 << 9, 1 << 30
    ADDRESS_BITS_AT = 26
    MEMORY, LIST = 0x3FFB0000, 0x3FFB8000

    def __post_init__(self) -> None:
        self.set_clock()

    def set_clock(self) -> None:
        self.store(self.CLOCK, 3 << 12)  # 80 MHz / 4

    def store(self, offset: int, value: int) -> None:
        self.regs.store(self.BASE[self.host] + offset, value)

    def load(self, offset: int) -> int:
        return self.regs.load(self.BASE[self.host] + offset)

    def make_list(self, at: int, buffer: int, count: int) -> None:
        """Size, length, end, owner; buffer; next."""
        for n, first in enumerate(range(0, count, PIECE)):
            size = min(PIECE, count - first)
            last = first + size == count
            words = (PIECE | size << 12 | last << 30 | 1 << 31, buffer + first, 0 if last else at + 12 * (n + 1))
            self.regs.chip.write(at + 12 * n, b"".join(word.to_bytes(4, "little") for word in words))

    def set_lengths(self, bits: int) -> None:
        self.store(self.OUT_BITS, bits - 1)
        self.store(self.IN_BITS, bits - 1)

    def start_dma(self) -> None:
        self.store(0x104, self.LIST & 0xFFFFF | 1 << 29)
        self.store(0x108, self.LIST + 0x400 & 0xFFFFF | 1 << 29)

    def clear_done(self) -> None:
        self.store(self.SLAVE, 0)

    def is_done(self) -> bool:
        return self.load(self.SLAVE) & self.DONE != 0

    def enable_interrupt(self, *, done: bool) -> None:
        self.store(self.SLAVE, self.DONE_ENABLED | (self.DONE if done else 0))

    def transfer(self, command: int, address: int, out: bytes) -> bytes:
        """Both ways at the same time. @return what came with the data"""
        chip, count = self.regs.chip, len(out)
        self.clear_done()
        self.store(self.USER, DUPLEX | HAS_OUT | HAS_IN | HAS_ADDRESS | HAS_COMMAND)
        self.store(self.USER1, 7 << self.ADDRESS_BITS_AT)
        self.store(self.USER2, 15 << 28 | (command >> 8 | command << 8) & 0xFFFF)  # its low byte goes first
        self.store(self.ADDRESS, address << 24)
        self.set_lengths(8 * count)
        if self.by_dma:
            chip.write(self.MEMORY, out)
            self.make_list(self.LIST, self.MEMORY, count)
            self.make_list(self.LIST + 0x400, self.MEMORY + 0x4000, count)
            self.start_dma()
        else:
            for n in range(0, count, 4):
                self.store(self.BUFFER + n, int.from_bytes(out[n : n + 4], "little"))
        self.store(self.CMD, self.START)
        before = chip.cycles
        self.regs.wait(CYCLES_OF_BIT * (24 + 8 * count) + 10)
        assert chip.cycles - before >= CYCLES_OF_BIT * (24 + 8 * count)
        assert self.is_done() and self.load(self.CMD) == 0
        if self.by_dma:
            return chip.read(self.MEMORY + 0x4000, count)
        words = [self.load(self.BUFFER + n) for n in range(0, count, 4)]
        return b"".join(word.to_bytes(4, "little") for word in words)[:count]

    # ---- of the W5500 ----

    def read(self, block: int, address: int, count: int) -> bytes:
        return self.transfer(address, block << 3, bytes(count))

    def write(self, block: int, address: int, data: bytes) -> None:
        self.transfer(address, block << 3 | 4, data)

    def number(self, address: int) -> int:
        """Of socket 0."""
        return int.from_bytes(self.read(1, address, 2), "big")


class S3Bus(Bus):
    """Of the ESP32-S3: GDMA, one length for both ways, interrupts of their own."""

    BASE: ClassVar = {2: 0x60024000, 3: 0x60025000}
    SELECT0: ClassVar = {2: 110, 3: 71}
    SOURCE: ClassVar = {2: 21, 3: 22}
    CMD, ADDRESS, CLOCK, USER, USER1, USER2 = 0x00, 0x04, 0x0C, 0x10, 0x14, 0x18
    OUT_BITS, IN_BITS, SLAVE, BUFFER = 0x1C, 0x1C, 0xE0, 0x98
    START, DONE, SLAVE_MODE = 1 << 24, 1 << 12, 1 << 26
    ADDRESS_BITS_AT = 27
    MEMORY, LIST = 0x3FCA0000, 0x3FCA8000
    DMA_CONF, INT_ENA, INT_CLR, INT_RAW, UPDATE = 0x30, 0x34, 0x38, 0x3C, 1 << 23
    GDMA, CHANNEL = 0x6003F000, 2 * 0xC0  # the third one

    def set_clock(self) -> None:
        self.store(0xE8, 7)  # the PLL's 80 MHz
        super().set_clock()
        self.store(self.CMD, self.UPDATE)
        assert self.load(self.CMD) == 0  # done

    def start_dma(self) -> None:
        self.store(self.DMA_CONF, 3 << 27)
        for half, place, start in ((0x60, self.LIST, 1 << 21), (0, self.LIST + 0x400, 1 << 22)):
            channel = self.GDMA + self.CHANNEL + half
            self.regs.store(channel + 0x48, self.host - 2)
            self.regs.store(channel + 0x14, 0x3FF)
            self.regs.store(channel + 0x20, place & 0xFFFFF)
            self.regs.store(channel + 0x20, place & 0xFFFFF | start)

    def clear_done(self) -> None:
        self.store(self.INT_CLR, self.DONE)

    def is_done(self) -> bool:
        return self.load(self.INT_RAW) & self.DONE != 0

    def enable_interrupt(self, *, done: bool) -> None:
        self.store(self.INT_ENA, self.DONE)
        if not done:
            self.clear_done()
