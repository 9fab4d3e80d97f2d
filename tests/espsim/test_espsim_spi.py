"""SPI2 and SPI3 of the virtual ESP32 as masters, and a W5500 behind them. Technical reference manual, chapter SPI; data
sheet W5500."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from registers import Registers
from wificnc.chip.espsim import Chip, ChipFault, VirtualChip

BASE = {2: 0x3FF64000, 3: 0x3FF65000}
SELECT0 = {2: 11, 3: 68}
CMD, ADDRESS, CLOCK, USER, USER1, USER2, OUT_BITS, IN_BITS = 0x00, 0x04, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C
SLAVE, BUFFER, DMA, OUT_LINK, IN_LINK = 0x38, 0x80, 0x100, 0x104, 0x108
START, DONE = 1 << 18, 1 << 4
DUPLEX, HAS_OUT, HAS_IN, HAS_ADDRESS, HAS_COMMAND = 1 << 0, 1 << 27, 1 << 28, 1 << 30, 1 << 31
MHZ_20 = 3 << 12  # 80 MHz / 4
MEMORY, LIST = 0x3FFB0000, 0x3FFB8000
PIN = 5

COMMON, SOCKET, TX, RX = 0, 1, 2, 3  # blocks
OPEN, SEND, RECEIVE = 0x01, 0x20, 0x40
OWN, OTHER, ALL = bytes.fromhex("0208dc010203"), bytes.fromhex("0208dc0a0b0c"), b"\xff" * 6


@dataclass
class Bus:
    """Transactions as ESP-IDF's spi_master makes them for the W5500: 16 bits of command, 8 of address, then data."""

    regs: Registers
    host: int
    by_dma: bool

    def __post_init__(self) -> None:
        self._store(CLOCK, MHZ_20)

    def _store(self, offset: int, value: int) -> None:
        self.regs.store(BASE[self.host] + offset, value)

    def _list(self, at: int, buffer: int, count: int) -> None:
        """Descriptors of up to 1024 bytes: size, length, end, owner; buffer; next."""
        for n, first in enumerate(range(0, count, 1024)):
            size = min(1024, count - first)
            last = first + size == count
            words = (1024 | size << 12 | last << 30 | 1 << 31, buffer + first, 0 if last else at + 12 * (n + 1))
            self.regs.chip.write(at + 12 * n, b"".join(word.to_bytes(4, "little") for word in words))

    def transfer(self, command: int, address: int, out: bytes) -> bytes:
        """Both ways at the same time. @return what came with the data"""
        chip, count = self.regs.chip, len(out)
        self._store(SLAVE, 0)
        self._store(USER, DUPLEX | HAS_OUT | HAS_IN | HAS_ADDRESS | HAS_COMMAND)
        self._store(USER1, 7 << 26)
        self._store(USER2, 15 << 28 | (command >> 8 | command << 8) & 0xFFFF)  # its low byte goes first
        self._store(ADDRESS, address << 24)
        for offset in (OUT_BITS, IN_BITS):
            self._store(offset, 8 * count - 1)
        if self.by_dma:
            chip.write(MEMORY, out)
            self._list(LIST, MEMORY, count)
            self._list(LIST + 0x400, MEMORY + 0x4000, count)
            self._store(OUT_LINK, LIST & 0xFFFFF | 1 << 29)
            self._store(IN_LINK, LIST + 0x400 & 0xFFFFF | 1 << 29)
        else:
            for n in range(0, count, 4):
                self._store(BUFFER + n, int.from_bytes(out[n : n + 4], "little"))
        self._store(CMD, START)
        before = chip.cycles
        self.regs.wait(12 * (24 + 8 * count) + 10)
        assert chip.cycles - before >= 12 * (24 + 8 * count)
        assert self.regs.load(BASE[self.host] + SLAVE) & DONE and self.regs.load(BASE[self.host] + CMD) == 0
        if self.by_dma:
            return chip.read(MEMORY + 0x4000, count)
        words = [self.regs.load(BASE[self.host] + BUFFER + n) for n in range(0, count, 4)]
        return b"".join(word.to_bytes(4, "little") for word in words)[:count]

    def read(self, block: int, address: int, count: int) -> bytes:
        return self.transfer(address, block << 3, bytes(count))

    def write(self, block: int, address: int, data: bytes) -> None:
        self.transfer(address, block << 3 | 4, data)

    def number(self, address: int) -> int:
        return int.from_bytes(self.read(SOCKET, address, 2), "big")


@pytest.fixture(params=[(2, False), (3, True)], ids=["SPI2", "SPI3 by DMA"])
def bus(esp32: VirtualChip, request: pytest.FixtureRequest) -> Iterator[Bus]:
    host, by_dma = request.param
    esp32.wire_w5500(host, 0)
    yield Bus(Registers(esp32, Chip.ESP32), host, by_dma)


def test_select_is_low_for_as_long_as_the_bits_take(esp32: VirtualChip) -> None:
    """24 + 64 bits of 20 MHz."""
    bus = Bus(Registers(esp32, Chip.ESP32), 2, by_dma=False)
    bus.regs.store(bus.regs.at.gpio + bus.regs.at.outputs + 4 * PIN, SELECT0[2])
    assert esp32.level(PIN) == 1
    esp32.record_edges()
    bus.transfer(0, 0, bytes(8))
    (fall, _, low), (rise, _, high) = (edge for edge in esp32.edges() if edge[1] == PIN)
    assert (low, high) == (0, 1) and rise - fall == 88 * 12


@pytest.mark.parametrize("level", [0, 1])
def test_without_a_chip_miso_is_its_pin(esp32: VirtualChip, level: int) -> None:
    bus = Bus(Registers(esp32, Chip.ESP32), 2, by_dma=False)
    esp32.drive(12, level)
    bus.regs.store(bus.regs.at.gpio + 0x130 + 4 * 9, 12 | 1 << 7)
    assert bus.transfer(0, 0, bytes(8)) == bytes([255 * level]) * 8


def test_the_interrupt_is_that_of_a_done_transaction(bus: Bus) -> None:
    at, source = bus.regs.at, {2: 30, 3: 31}[bus.host]
    bus.regs.store(at.matrix + 4 * source, 19)
    bus.transfer(0, 0, bytes(4))
    assert not bus.regs.chip.cpu().interrupt & 1 << 19
    bus.regs.store(BASE[bus.host] + SLAVE, DONE | 1 << 9)
    assert bus.regs.chip.cpu().interrupt & 1 << 19
    bus.regs.store(BASE[bus.host] + SLAVE, 1 << 9)
    assert not bus.regs.chip.cpu().interrupt & 1 << 19


@pytest.mark.parametrize(
    ("offset", "value"), [(USER, HAS_OUT | 1 << 16), (SLAVE, 1 << 30), (OUT_BITS, 6)], ids=["3 wires", "slave", "bits"]
)
def test_another_transaction_is_named(esp32: VirtualChip, offset: int, value: int) -> None:
    bus = Bus(Registers(esp32, Chip.ESP32), 2, by_dma=False)
    bus._store(USER, HAS_OUT)
    bus._store(OUT_BITS, 7)
    bus._store(offset, value)
    with pytest.raises(ChipFault, match="a transaction of SPI2"):
        bus._store(CMD, START)


# ---- the W5500 ----


def open_socket(bus: Bus, mode: int = 4) -> None:
    """As esp_eth_mac_w5500.c: all memory for socket 0, MACRAW."""
    bus.write(COMMON, 0x00, b"\x80")
    bus.write(SOCKET, 0x1E, b"\x10\x10")
    bus.write(COMMON, 0x09, OWN)
    bus.write(SOCKET, 0x00, bytes([mode]))
    bus.write(SOCKET, 0x01, bytes([OPEN]))
    assert bus.read(SOCKET, 0x01, 1) == b"\0" and bus.read(SOCKET, 0x03, 1) == b"\x42"


def frame(to: bytes, size: int, seed: int = 1) -> bytes:
    return to + random.Random(seed).randbytes(size - 6)


def receive(bus: Bus) -> bytes:
    assert bus.number(0x26) > 0
    at = bus.number(0x28)
    size = int.from_bytes(bus.read(RX, at, 2), "big") - 2
    data = b"".join(bus.read(RX, at + 2 + n & 0xFFFF, min(64, size - n)) for n in range(0, size, 64))
    bus.write(SOCKET, 0x28, (at + 2 + size & 0xFFFF).to_bytes(2, "big"))
    bus.write(SOCKET, 0x01, bytes([RECEIVE]))
    return data


def send(bus: Bus, data: bytes) -> None:
    at = bus.number(0x24)
    for n in range(0, len(data), 64):
        bus.write(TX, at + n & 0xFFFF, data[n : n + 64])
    bus.write(SOCKET, 0x24, (at + len(data) & 0xFFFF).to_bytes(2, "big"))
    bus.write(SOCKET, 0x01, bytes([SEND]))
    assert bus.read(SOCKET, 0x02, 1)[0] & 0x10
    bus.write(SOCKET, 0x02, b"\x10")
    assert not bus.read(SOCKET, 0x02, 1)[0] & 0x10


def test_version_and_link(bus: Bus) -> None:
    """What the driver asks first."""
    assert bus.read(COMMON, 0x39, 1) == b"\x04"
    assert bus.read(COMMON, 0x2E, 1)[0] & 7 == 7
    bus.regs.chip.set_link(False)
    assert bus.read(COMMON, 0x2E, 1)[0] & 1 == 0


def test_frames_of_all_sizes_go_round_the_buffers(bus: Bus) -> None:
    """More than both buffers of 16 KB, in order."""
    open_socket(bus)
    for n, size in enumerate([60, 1514, 61, 999] * 5):
        sent = frame(OTHER, size, n)
        send(bus, sent)
        assert bus.regs.chip.take_frame() == sent
        assert bus.number(0x20) == 16384
        assert bus.regs.chip.put_frame(sent)
        assert receive(bus) == sent
    assert bus.regs.chip.take_frame() == b"" and bus.number(0x26) == 0


def test_a_short_frame_is_filled_up(bus: Bus) -> None:
    """A cable has none below 60 bytes, and ESP-IDF's driver stops at one."""
    open_socket(bus)
    assert bus.regs.chip.put_frame(frame(OWN, 42))
    assert receive(bus) == frame(OWN, 42) + bytes(18)


def test_a_full_buffer_drops_and_says_so(bus: Bus) -> None:
    open_socket(bus)
    chip = bus.regs.chip
    taken = sum(chip.put_frame(frame(OWN, 1514, n)) for n in range(12))
    assert taken == 16384 // 1516 and bus.number(0x26) == taken * 1516
    for n in range(taken):
        assert receive(bus) == frame(OWN, 1514, n)
    assert chip.put_frame(frame(OWN, 60))


def test_the_filter_takes_own_frames_and_those_for_all(bus: Bus) -> None:
    open_socket(bus, 0x84)
    chip = bus.regs.chip
    assert chip.put_frame(frame(OWN, 60)) and chip.put_frame(frame(ALL, 60))
    assert chip.put_frame(frame(bytes.fromhex("01005e0000fb"), 60)) and not chip.put_frame(frame(OTHER, 60))
    assert bus.read(COMMON, 0x17, 1) == b"\x01"  # socket 0 has events


def test_no_frame_without_a_socket_or_a_cable(bus: Bus) -> None:
    chip = bus.regs.chip
    assert not chip.put_frame(frame(OWN, 60))
    open_socket(bus)
    chip.set_link(False)
    assert not chip.put_frame(frame(OWN, 60))


def test_frames_of_fixed_length_are_named(bus: Bus) -> None:
    with pytest.raises(ChipFault, match="fixed length"):
        bus.transfer(0x39, 1, bytes(1))
