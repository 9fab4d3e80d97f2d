"""From a program of this computer to one in the virtual ESP32 and back: sockets, libslirp, the cable, a W5500, SPI, and
code of the processor that answers (net/main.c)."""

from __future__ import annotations

import contextlib
import random
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import guests
import pytest
from guests import ALL, ARP, HOST, ICMP, IPV4, OWN
from patience import HANG_S
from wificnc_chips.cable import Cable, Network
from wificnc_chips.esp32.chip import CPU_HZ, Chip, Cpu, VirtualChip
from wificnc_chips.slirp import UserNetwork, has_slirp
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain
from xtensa_programs import bare
from xtensa_programs import code as c

pytestmark = pytest.mark.slow  # compiles a program for the virtual chip

ROOT = Path(__file__).resolve().parents[3]
LOCAL = "127.0.0.1"
FAR = bytes.fromhex("0208dc0a0b0c")
ECHO = 7
SLICE = CPU_HZ // 1000


@pytest.fixture(scope="module")
def program() -> bytes:
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(tools):
        pytest.skip(said)
    own = [Path(__file__).with_name("net") / "main.c"]
    return bare.build(tools, ROOT, Chip.ESP32, [], own, ROOT / "build" / "espsim" / "net").read_bytes()


class Answering:
    """The chip with its program, as a cable wants it."""

    cpu_hz = CPU_HZ

    def __init__(self, program: bytes) -> None:
        self.chip = VirtualChip(Chip.ESP32)
        self.chip.wire_w5500(3, 0)
        vectors = bare.PLACES[Chip.ESP32].vectors
        self.chip.load(program)
        self.chip.write(vectors, c.window_vectors())
        loaded = self.chip.cpu()
        cpu = Cpu(pc=loaded.pc, ps=0x40020, vecbase=vectors, windowstart=1)
        cpu.a[1] = loaded.a[1] - 64
        self.chip.set_cpu(cpu)
        self.put_frame, self.set_link = self.chip.put_frame, self.chip.set_link
        self.chip.run(10 * SLICE)  # until its socket is open

    @property
    def cycles(self) -> int:
        return self.chip.cycles

    def take_frames(self) -> list[bytes]:
        return list(iter(self.chip.take_frame, b""))

    def number(self, name: str) -> int:
        return int.from_bytes(self.chip.read(self.chip.symbol(name), 4), "little")


@pytest.fixture
def answering(program: bytes) -> Iterator[Answering]:
    answering = Answering(program)
    with answering.chip:
        yield answering


class Frames:
    """A network of frames that a test makes."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.comes: list[bytes] = []

    def send(self, frame: bytes) -> None:
        self.sent.append(frame)

    def receive(self, _now_ns: int) -> list[bytes]:
        frames, self.comes = self.comes, []
        return frames

    def close(self) -> None:
        pass


def run(answering: Answering, cable: Cable, done: Callable[[], bool]) -> None:
    """Until it is done, a millisecond after the other."""
    deadline = time.monotonic() + HANG_S
    while not done():
        assert time.monotonic() < deadline, f"{answering.number('frames')} frames taken"
        answering.chip.run(SLICE)
        cable.carry()


# ---- by frames ----


def echo_request(number: int, data: bytes) -> bytes:
    head = struct.pack("!BBHHH", 8, 0, 0, 1, number)
    total = guests.checksum(head + data)
    packet = head[:2] + total.to_bytes(2, "big") + head[4:] + data
    return guests.MAC + FAR + IPV4 + guests.ip_packet(ICMP, HOST, OWN, packet)


def test_arp_and_ping_of_each_size(answering: Answering) -> None:
    """Bytes come back as they were, whatever their count: the W5500's buffers wrap many times."""
    network = Frames()
    cable = Cable(answering, network)
    asked = struct.pack("!HHBBH", 1, 0x800, 6, 4, 1) + FAR + HOST + bytes(6) + OWN
    network.comes = [ALL + FAR + ARP + asked]
    run(answering, cable, lambda: bool(network.sent))
    (said,) = network.sent
    assert said[:12] == FAR + guests.MAC and said[20:42] == b"\0\2" + guests.MAC + OWN + FAR + HOST
    dice = random.Random(11)
    for number, size in enumerate((0, 1, 17, 18, 19, 63, 64, 65, 500, 1471, 1472, *[1472] * 20)):
        network.sent.clear()
        data = dice.randbytes(size)
        network.comes = [echo_request(number, data)]
        run(answering, cable, lambda: bool(network.sent))
        (said,) = network.sent
        packet = said[34:]
        assert said[:12] == FAR + guests.MAC and said[26:34] == OWN + HOST, size
        assert packet[:2] == b"\0\0" and packet[4:] == struct.pack("!HH", 1, number) + data, size
        assert guests.checksum(packet) == 0 and guests.checksum(said[14:34]) == 0, size
    assert cable.lost == 0


def test_frames_of_a_full_buffer_are_lost_whole(answering: Answering) -> None:
    """More come than 16 KB hold: some are lost, none is damaged, and later ones are answered again."""
    network = Frames()
    cable = Cable(answering, network)
    datas = [bytes((n,)) * 1400 for n in range(40)]
    answering.chip.run(5 * SLICE)
    for n, data in enumerate(datas):
        cable.lost += not answering.put_frame(echo_request(n, data))
    assert cable.lost == 40 - 16384 // (1400 + 42 + 2)
    run(answering, cable, lambda: len(network.sent) == 40 - cable.lost)
    assert [said[42:] for said in network.sent] == datas[: 40 - cable.lost]
    network.sent.clear()
    network.comes = [echo_request(99, b"again")]
    run(answering, cable, lambda: bool(network.sent))
    assert network.sent[0][42:47] == b"again"


# ---- by sockets of this computer ----


class Online:
    """The chip in libslirp's network, and one of this computer's sockets."""

    def __init__(self, answering: Answering) -> None:
        if not has_slirp():
            pytest.skip("no libslirp: apt-get install libslirp0")
        self.answering, self.network = answering, UserNetwork()
        checked: Network = self.network
        self.cable = Cable(answering, checked)

    def run(self, done: Callable[[], bool]) -> None:
        run(self.answering, self.cable, done)


@pytest.fixture
def online(answering: Answering) -> Iterator[Online]:
    online = Online(answering)
    yield online
    online.cable.close()


def received(client: socket.socket, into: bytearray) -> None:
    with contextlib.suppress(BlockingIOError):
        into += client.recv(1 << 16)


def test_datagrams_come_back(online: Online) -> None:
    port = online.network.forward(LOCAL, 0, ECHO, udp=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.connect((LOCAL, port))
        client.setblocking(False)
        for size in (0, 1, 100, 1472):
            data, got = random.Random(size).randbytes(size), bytearray()
            client.send(data)
            turns = iter(range(50))
            online.run(lambda got=got, turns=turns: received(client, got) or len(got) > 0 or next(turns, 50) == 50)  # type: ignore[misc]
            assert got == data


def echoed(online: Online, client: socket.socket, data: bytes) -> bytes:
    """All that comes back of what is sent."""
    got, left = bytearray(), memoryview(data)

    def step() -> bool:
        nonlocal left
        with contextlib.suppress(BlockingIOError):
            left = left[client.send(left) :] if left else left
        received(client, got)
        return len(got) == len(data)

    online.run(step)
    return bytes(got)


def test_a_call_carries_every_byte(online: Online) -> None:
    port = online.network.forward(LOCAL, 0, ECHO)
    data = random.Random(3).randbytes(60_000)
    with socket.create_connection((LOCAL, port), HANG_S) as client:
        client.setblocking(False)
        assert echoed(online, client, data) == data
    assert online.cable.lost == 0


def test_a_call_survives_a_cable_that_is_out(online: Online) -> None:
    """TCP repeats what was lost meanwhile; nothing is missing or comes twice."""
    port = online.network.forward(LOCAL, 0, ECHO)
    data = random.Random(4).randbytes(4000)
    with socket.create_connection((LOCAL, port), HANG_S) as client:
        client.setblocking(False)
        assert echoed(online, client, b"before") == b"before"
        client.send(data[:1000])
        online.cable.plug(False)
        begin = online.answering.cycles
        online.run(lambda: online.answering.cycles - begin > 2 * CPU_HZ)
        got = bytearray()
        received(client, got)
        assert not got
        online.cable.plug(True)
        online.run(lambda: received(client, got) or len(got) >= 1000)  # type: ignore[func-returns-value]
        assert bytes(got) == data[:1000]
        assert echoed(online, client, data) == data
