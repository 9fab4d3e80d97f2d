"""SPI2 and SPI3 of both chips as masters, and a W5500 behind them. Technical reference manuals, chapters SPI, SPI
Controller, GDMA Controller; data sheet W5500."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest
from registers import Registers
from spi_bus import CYCLES_OF_BIT, HAS_OUT, Bus, S3Bus
from wificnc_chips.esp32.chip import Chip, VirtualChip
from wificnc_chips.fault import ChipFault

PIN = 5
INPUTS = {Chip.ESP32: 0x130, Chip.ESP32S3: 0x154}
MISO = {Chip.ESP32: 9, Chip.ESP32S3: 102}  # of SPI2

COMMON, SOCKET, TX, RX = 0, 1, 2, 3  # blocks
OPEN, SEND, RECEIVE = 0x01, 0x20, 0x40
OWN, OTHER, ALL = bytes.fromhex("0208dc010203"), bytes.fromhex("0208dc0a0b0c"), b"\xff" * 6


def make_bus(chip: VirtualChip, kind: Chip, host: int = 2, *, by_dma: bool = False) -> Bus:
    return (Bus if kind == Chip.ESP32 else S3Bus)(Registers(chip, kind), host, by_dma)


@pytest.fixture(params=[(2, False), (3, True)], ids=["SPI2", "SPI3 by DMA"])
def bus(chip: VirtualChip, kind: Chip, request: pytest.FixtureRequest) -> Iterator[Bus]:
    host, by_dma = request.param
    chip.wire_w5500(host, 0)
    yield make_bus(chip, kind, host, by_dma=by_dma)


@pytest.fixture
def kind(request: pytest.FixtureRequest) -> Chip:
    return Chip(request.node.callspec.params["chip"])


def test_select_is_low_for_as_long_as_the_bits_take(chip: VirtualChip, kind: Chip) -> None:
    """24 + 64 bits of 20 MHz."""
    bus = make_bus(chip, kind)
    bus.regs.store(bus.regs.at.gpio + bus.regs.at.outputs + 4 * PIN, bus.SELECT0[2])
    bus.regs.store(bus.regs.at.gpio + 0x24, 1 << PIN)
    assert chip.level(PIN) == 1
    chip.record_edges()
    bus.transfer(0, 0, bytes(8))
    (fall, _, low), (rise, _, high) = (edge for edge in chip.edges() if edge[1] == PIN)
    assert (low, high) == (0, 1) and rise - fall == 88 * CYCLES_OF_BIT


@pytest.mark.parametrize("level", [0, 1])
def test_without_a_chip_miso_is_its_pin(chip: VirtualChip, kind: Chip, level: int) -> None:
    bus = make_bus(chip, kind)
    chip.drive(12, level)
    bus.regs.store(bus.regs.at.gpio + INPUTS[kind] + 4 * MISO[kind], 12 | 1 << 7)
    assert bus.transfer(0, 0, bytes(8)) == bytes([255 * level]) * 8


def test_the_interrupt_is_that_of_a_done_transaction(bus: Bus) -> None:
    at = bus.regs.at
    bus.regs.store(at.matrix + 4 * bus.SOURCE[bus.host], 19)
    bus.transfer(0, 0, bytes(4))
    assert not bus.regs.chip.cpu().interrupt & 1 << 19
    bus.enable_interrupt(done=True)
    assert bus.regs.chip.cpu().interrupt & 1 << 19
    bus.enable_interrupt(done=False)
    assert not bus.regs.chip.cpu().interrupt & 1 << 19


@pytest.mark.parametrize("what", ["3 wires", "slave", "bits"])
def test_another_transaction_is_named(chip: VirtualChip, kind: Chip, what: str) -> None:
    bus = make_bus(chip, kind)
    three_wires = HAS_OUT | 1 << (16 if kind == Chip.ESP32 else 17)
    offset, value = {
        "3 wires": (bus.USER, three_wires),
        "slave": (bus.SLAVE, bus.SLAVE_MODE),
        "bits": (bus.OUT_BITS, 6),
    }[what]
    bus.store(bus.USER, HAS_OUT)
    bus.store(bus.OUT_BITS, 7)
    bus.store(offset, value)
    with pytest.raises(ChipFault, match="a transaction of SPI2"):
        bus.store(bus.CMD, bus.START)


# ---- of the ESP32-S3 ----


@pytest.fixture
def s3() -> Iterator[VirtualChip]:
    with VirtualChip(Chip.ESP32S3) as chip:
        yield chip


def test_select_has_its_setup_and_hold_times(s3: VirtualChip) -> None:
    """One clock before the first bit and two after the last: USER's CS_SETUP and CS_HOLD, USER1's times."""
    bus = make_bus(s3, Chip.ESP32S3)
    bus.regs.store(bus.regs.at.gpio + bus.regs.at.outputs + 4 * PIN, bus.SELECT0[2])
    bus.regs.store(bus.regs.at.gpio + 0x24, 1 << PIN)
    bus.store(bus.USER, HAS_OUT | 1 << 7 | 1 << 6)
    bus.store(bus.USER1, 2 << 22)
    bus.set_lengths(32)
    s3.record_edges()
    bus.store(bus.CMD, bus.START)
    bus.regs.wait(1000)
    (fall, _, _), (rise, _, _) = (edge for edge in s3.edges() if edge[1] == PIN)
    assert rise - fall == (1 + 32 + 2) * CYCLES_OF_BIT


def test_shift_registers_show_the_word_with_select(s3: VirtualChip) -> None:
    """As the step engine wires them: clock, data, and the latch at select. Bytes leave from the lowest on."""
    bus = make_bus(s3, Chip.ESP32S3)
    for pin, signal in ((4, 101), (6, 103), (PIN, 110)):
        bus.regs.store(bus.regs.at.gpio + bus.regs.at.outputs + 4 * pin, signal)
        bus.regs.store(bus.regs.at.gpio + 0x24, 1 << pin)
    s3.wire_shift_registers(4, 6, PIN)
    bus.store(bus.USER, HAS_OUT)
    bus.set_lengths(32)
    bus.store(bus.BUFFER, int.from_bytes(bytes.fromhex("80c0a001"), "little"))
    bus.store(bus.CMD, bus.START)
    bus.regs.wait(16 * CYCLES_OF_BIT)
    assert s3.shift_outputs() == 0xFFFFFFFF
    bus.regs.wait(20 * CYCLES_OF_BIT)
    assert s3.shift_outputs() == 0x80C0A001


def test_gdma_says_what_it_has_moved(s3: VirtualChip) -> None:
    """The receiver's entries have what came; both halves have their interrupts and the last entry's place."""
    bus = S3Bus(Registers(s3, Chip.ESP32S3), 3, by_dma=True)
    channel, count = bus.GDMA + bus.CHANNEL, 1500
    at = bus.regs.at
    bus.regs.store(channel + 0x10, 2)
    bus.regs.store(at.matrix + 4 * (66 + 2), 19)
    bus.transfer(0, 0, bytes(count))
    assert bus.regs.load(channel + 0x08) & 3 == 3 and bus.regs.load(channel + 0x68) & 0xB == 0xB
    assert bus.regs.load(channel + 0x28) == bus.LIST + 0x400 + 12 and bus.regs.load(channel + 0x88) == bus.LIST + 12
    heads = [int.from_bytes(s3.read(bus.LIST + 0x400 + 12 * n, 4), "little") for n in range(2)]
    assert [head >> 12 & 0xFFF for head in heads] == [1024, count - 1024]
    assert [head >> 30 for head in heads] == [0, 1]  # the processor's again, and where the frame ends
    assert s3.cpu().interrupt & 1 << 19
    bus.regs.store(channel + 0x14, 2)
    assert not s3.cpu().interrupt & 1 << 19


def test_gdma_outside_of_memory_is_named(s3: VirtualChip) -> None:
    bus = S3Bus(Registers(s3, Chip.ESP32S3), 2, by_dma=True)
    bus.LIST = 0x3FC00000
    s3.write(bus.MEMORY, bytes(4))
    bus.store(bus.USER, HAS_OUT)
    bus.set_lengths(32)
    bus.start_dma()
    bus.store(bus.CMD, bus.START)
    with pytest.raises(ChipFault, match="an entry of its list at 3fc00000, where there is no memory"):
        bus.regs.wait(1000)


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
