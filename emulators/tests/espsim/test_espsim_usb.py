"""The S3's USB-Serial-JTAG as a serial port. Technical Reference Manual, chapter USB Serial/JTAG Controller."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from registers import Registers
from wificnc_chips.esp32.chip import Chip, VirtualChip
from wificnc_chips.fault import ChipFault

USB = 0x60038000
EP1, EP1_CONF, RAW, STATUS, ENABLED, CLEAR, CONF0, FRAME = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x24
WR_DONE, IN_FREE, OUT_AVAIL = 1, 2, 4
SOF, OUT_RECEIVED, IN_EMPTY = 1 << 1, 1 << 2, 1 << 3
PACKET, MS, SOURCE, PAD_ENABLE = 64, 240_000, 96, 1 << 14


class Port:
    def __init__(self, chip: VirtualChip) -> None:
        self.chip, self.regs = chip, Registers(chip, Chip.ESP32S3)

    def store(self, offset: int, value: int) -> None:
        self.regs.store(USB + offset, value)

    def load(self, offset: int) -> int:
        return self.regs.load(USB + offset)

    def send(self, data: bytes, *, done: bool = True) -> None:
        """As the driver: for as long as there is room, then the packet is for the computer."""
        for byte in data:
            assert self.load(EP1_CONF) & IN_FREE
            self.store(EP1, byte)
        if done:
            self.store(EP1_CONF, WR_DONE)

    def receive(self) -> bytes:
        data = b""
        while self.load(EP1_CONF) & OUT_AVAIL:
            data += bytes((self.load(EP1),))
        return data


@pytest.fixture
def port() -> Iterator[Port]:
    with VirtualChip(Chip.ESP32S3) as chip:
        chip.plug_usb()
        yield Port(chip)


def test_a_packet_goes_when_it_is_done(port: Port) -> None:
    port.store(CLEAR, IN_EMPTY)
    port.send(b"ok", done=False)
    port.regs.wait(MS)
    assert port.chip.read_usb() == b"" and not port.load(RAW) & IN_EMPTY
    port.store(EP1_CONF, WR_DONE)
    assert not port.load(EP1_CONF) & IN_FREE
    port.regs.wait(MS)
    assert port.chip.read_usb() == b"ok"
    assert port.load(RAW) & IN_EMPTY and port.load(EP1_CONF) & IN_FREE


def test_a_full_packet_goes_by_itself(port: Port) -> None:
    """And the empty one that ends the transfer raises the interrupt as well: the driver waits for it."""
    port.send(bytes(PACKET), done=False)
    assert not port.load(EP1_CONF) & IN_FREE
    port.regs.wait(MS)
    assert port.chip.read_usb() == bytes(PACKET)
    port.store(CLEAR, IN_EMPTY)
    port.store(EP1_CONF, WR_DONE)
    port.regs.wait(MS)
    assert port.chip.read_usb() == b"" and port.load(RAW) & IN_EMPTY


def test_a_packet_takes_its_time_on_the_wires(port: Port) -> None:
    """12 Mbit/s, no less than its bits."""
    port.send(bytes(PACKET), done=False)
    port.regs.wait(8 * PACKET * 20)
    assert port.chip.read_usb() == b""
    port.regs.wait(8 * PACKET * 20)
    assert port.chip.read_usb() == bytes(PACKET)


@pytest.mark.parametrize("count", [1, PACKET - 1, PACKET, PACKET + 1, 1000])
def test_bytes_of_the_computer_come_in_packets(port: Port, count: int) -> None:
    data = bytes(n % 251 for n in range(count))
    port.chip.write_usb(data)
    got = b""
    for _ in range(-(-count // PACKET)):
        port.regs.wait(MS)
        assert port.load(RAW) & OUT_RECEIVED
        port.store(CLEAR, OUT_RECEIVED)
        piece = port.receive()
        assert len(piece) == min(PACKET, count - len(got))
        got += piece
    port.regs.wait(MS)
    assert got == data and not port.load(RAW) & OUT_RECEIVED


def test_interrupts(port: Port) -> None:
    """The packet for the computer is empty from reset on: enabling it is what starts the driver's output."""
    port.regs.store(port.regs.at.matrix + 4 * SOURCE, 19)
    assert not port.chip.cpu().interrupt & 1 << 19
    port.store(ENABLED, IN_EMPTY)
    assert port.chip.cpu().interrupt & 1 << 19 and port.load(STATUS) == IN_EMPTY
    port.store(CLEAR, IN_EMPTY)
    assert not port.chip.cpu().interrupt & 1 << 19
    port.store(ENABLED, OUT_RECEIVED)
    port.chip.write_usb(b"?")
    port.regs.wait(MS)
    assert port.chip.cpu().interrupt & 1 << 19


def test_a_computer_is_seen_by_its_frames(port: Port) -> None:
    """One each millisecond, which ESP-IDF looks for at each tick; none without a computer or a pad."""
    begin = port.load(FRAME)
    for _ in range(5):
        port.store(CLEAR, SOF)
        port.regs.wait(MS)
        assert port.load(RAW) & SOF
    assert port.load(FRAME) - begin == 5
    port.chip.plug_usb(False)
    port.store(CLEAR, SOF)
    port.regs.wait(5 * MS)
    assert not port.load(RAW) & SOF
    port.chip.plug_usb()
    port.store(CONF0, port.load(CONF0) & ~PAD_ENABLE)
    port.regs.wait(5 * MS)
    assert not port.load(RAW) & SOF


def test_without_a_computer_nothing_is_taken(port: Port) -> None:
    port.chip.plug_usb(False)
    port.send(b"lost")
    port.chip.write_usb(b"?")
    port.regs.wait(10 * MS)
    assert port.chip.read_usb() == b"" and not port.load(EP1_CONF) & (IN_FREE | OUT_AVAIL)
    port.chip.plug_usb()
    port.regs.wait(MS)
    assert port.chip.read_usb() == b"lost" and not port.load(EP1_CONF) & OUT_AVAIL


def test_wrong_use_is_named(port: Port) -> None:
    with pytest.raises(ChipFault, match="USB-Serial-JTAG is read while it has no byte"):
        port.load(EP1)
    with VirtualChip(Chip.ESP32S3) as chip, pytest.raises(ChipFault, match="while its packet waits for the computer"):
        other = Port(chip)
        other.send(b"1")
        other.store(EP1, 0)


def test_the_esp32_has_no_such_port() -> None:
    with VirtualChip(Chip.ESP32) as chip, pytest.raises(ValueError, match="no USB-Serial-JTAG"):
        chip.plug_usb()
