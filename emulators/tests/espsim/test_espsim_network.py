"""What a virtual chip's Ethernet is connected to: libslirp, a TAP device, and the cable to it. The chip's end is made
by hand here, frame by frame: RFC 791, 768, 793, 826, 2131, 1624."""

from __future__ import annotations

import random
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import guests
import pytest
from guests import ACK, ALL, ANY, EVERYONE, HOST, OWN, PUSH, SYN, TCP, Guest
from patience import HANG_S
from wificnc.errors import ServeError
from wificnc_chips import slirp, tap
from wificnc_chips.cable import Cable
from wificnc_chips.slirp import UserNetwork, with_address

LOCAL = "127.0.0.1"
MS = 1_000_000
SERVER = 23


class End:
    """The network with its guest, in steps of a millisecond of the guest's time."""

    def __init__(self) -> None:
        if not slirp.has_slirp():
            pytest.skip("no libslirp: apt-get install libslirp0")
        self.network = UserNetwork()
        self.guest = Guest(self.network.send)
        self.now_ns = 0

    def run(self, done: Callable[[], bool], what: str = "nothing has come") -> None:
        """Until it is done."""
        deadline = time.monotonic() + HANG_S
        while not done():
            assert time.monotonic() < deadline, what
            self.turn()

    def turn(self) -> None:
        self.now_ns += MS
        for frame in self.network.receive(self.now_ns):
            self.guest.take(frame)

    def next(self) -> bytes:
        self.run(lambda: bool(self.guest.got))
        return self.guest.got.pop(0)


@pytest.fixture
def end() -> Iterator[End]:
    end = End()
    yield end
    end.network.close()


def ports_of(frame: bytes) -> tuple[int, int]:
    source, to = struct.unpack_from("!HH", frame, 34)
    return source, to


def dhcp(kind: int) -> bytes:
    head = struct.pack("!BBBBIHH4s4s4s4s16s64s128s", 1, 1, 6, 0, 0x1234, 0, 0x8000, *[ANY] * 4, guests.MAC, b"", b"")
    return head + b"\x63\x82\x53\x63" + bytes((53, 1, kind, 255))


def test_dhcp_gives_the_address_that_ports_lead_to(end: End) -> None:
    for kind, answer in ((1, 2), (3, 5)):  # discover: offer; request: acknowledgment
        end.guest.ip(guests.udp_packet(ANY, EVERYONE, (68, 67), dhcp(kind)), ALL)
        frame = end.next()
        assert ports_of(frame) == (67, 68) and frame[42 + 16 : 42 + 20] == OWN
        assert frame[42 + 240 :].startswith(bytes((53, 1, answer)))
    assert ".".join(map(str, OWN)) == slirp.CHIP_ADDRESS


def answered(end: End, client: socket.socket) -> tuple[tuple[int, int], int]:
    """The guest takes a call. @return its ports, and the caller's next number"""
    call = end.next()
    assert call[23] == TCP and call[47] & (SYN | ACK) == SYN and call[26:30] == HOST and guests.sums_are_right(call)
    caller, own = ports_of(call)
    number = int.from_bytes(call[38:42], "big") + 1
    assert own == SERVER
    end.guest.tcp((own, caller), (1000, number), SYN | ACK)
    end.run(lambda: any(frame[47] & ACK for frame in end.guest.got), "no acknowledgment of the answer")
    end.guest.got.clear()
    client.settimeout(HANG_S)
    return (own, caller), number


def test_a_call_of_this_computer_is_answered(end: End) -> None:
    """Bytes go both ways, in order."""
    port = end.network.forward(LOCAL, 0, SERVER)
    with socket.create_connection((LOCAL, port), HANG_S) as client:
        ports, number = answered(end, client)
        client.sendall(b"$I\n")
        frame = end.next()
        while not frame.endswith(b"$I\n"):  # others say how much may be sent
            frame = end.next()
        assert guests.sums_are_right(frame) and int.from_bytes(frame[38:42], "big") == number
        end.guest.tcp(ports, (1001, number + 3), PUSH | ACK, b"ok\r\n")
        end.turn()
        assert client.recv(100) == b"ok\r\n"


def test_a_guest_that_is_silent_is_called_again_in_its_own_time(end: End) -> None:
    """TCP's timers follow the chip's clock: a frame that is lost is repeated after seconds of its time."""
    port = end.network.forward(LOCAL, 0, SERVER)
    with socket.create_connection((LOCAL, port), HANG_S):
        first, at_ns = end.next(), end.now_ns
        second = end.next()
        assert second[34:42] == first[34:42] and second[47] & SYN
        assert 1000 * MS <= end.now_ns - at_ns <= 10_000 * MS


@pytest.mark.parametrize("own", [LOCAL, "127.0.0.83"])
def test_datagrams_and_their_answers(end: End, own: str) -> None:
    """Whatever address of this computer a program has; what is sent to another port of it arrives there, too (WMC3's
    status reports)."""
    port = end.network.forward(LOCAL, 0, 58427, udp=True)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as status,
    ):
        for each in (client, status):
            each.bind((own, 0))
            each.settimeout(HANG_S)
        client.sendto(b"question", (LOCAL, port))
        frame = end.next()
        assert frame[26:34] == HOST + OWN and frame[42:] == b"question" and guests.sums_are_right(frame)
        assert ports_of(frame) == (client.getsockname()[1], 58427)
        for to in (client, status):
            end.guest.udp((58427, to.getsockname()[1]), b"answer")
            end.turn()
            data, sender = to.recvfrom(100)
            assert data == b"answer" and sender == (LOCAL, port)


def test_the_guest_calls_no_one(end: End) -> None:
    """Neither this computer's programs nor others: not by TCP, not from other UDP ports, not to groups."""
    end.network.forward(LOCAL, 0, 58427, udp=True)
    with (
        socket.create_server((LOCAL, 0)) as server,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
    ):
        listener.bind((LOCAL, 0))
        end.guest.udp((5000, listener.getsockname()[1]), b"call")
        end.guest.udp((58427, 5353), b"call", to=bytes((224, 0, 0, 251)))
        end.guest.udp((58427, 53), b"call", to=bytes((192, 0, 2, 1)))
        end.guest.tcp((4000, server.getsockname()[1]), (1, 0), SYN)
        for _ in range(100):
            end.turn()
        server.setblocking(False)
        listener.setblocking(False)
        for take in (server.accept, lambda: listener.recv(100)):
            with pytest.raises(BlockingIOError):
                take()
        assert end.guest.got == []


def test_damaged_frames_harm_nothing(end: End) -> None:
    dice = random.Random(7)
    end.network.forward(LOCAL, 0, 58427, udp=True)
    good = ALL + guests.MAC + guests.IPV4 + guests.udp_packet(OWN, HOST, (58427, 9), bytes(40))
    for _ in range(3000):
        frame = bytearray(good[: dice.randrange(len(good) + 1)])
        for _ in range(dice.randrange(4)):
            if frame:
                frame[dice.randrange(len(frame))] = dice.randrange(256)
        if bytes(frame[30:34]) in (HOST, OWN, EVERYONE) or len(frame) < 34:
            end.network.send(bytes(frame))
    end.turn()


def test_another_address_keeps_the_sums_right() -> None:
    dice = random.Random(5)
    for size in range(200):
        old, new, third = (dice.randbytes(4) for _ in range(3))
        frame = ALL + guests.MAC + guests.IPV4 + guests.udp_packet(old, third, (1, dice.randrange(65536)), bytes(size))
        assert with_address(frame, 26, new) == frame[:14] + guests.udp_packet(new, third, ports_of(frame), bytes(size))
        back = with_address(with_address(frame, 30, new), 30, third)
        assert guests.sums_are_right(with_address(frame, 30, new)) and back == frame


def test_a_port_in_use_is_named(end: End) -> None:
    with socket.create_server((LOCAL, 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ServeError, match=f"cannot listen at TCP port {LOCAL}:{port}: Address already in use"):
            end.network.forward(LOCAL, port, SERVER)
    with pytest.raises(ServeError, match="::1 has no IPv4 address"):
        end.network.forward("::1", 0, SERVER)


def test_without_the_library_its_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slirp, "LIBRARIES", ("libnone.so",))
    slirp._load.cache_clear()
    try:
        assert not slirp.has_slirp()
        with pytest.raises(ServeError, match="needs libslirp") as raised:
            UserNetwork()
        assert "apt install libslirp0" in (raised.value.hint or "")
    finally:
        slirp._load.cache_clear()


# ---- the cable ----


class Chip:
    """Takes frames while it has room."""

    cpu_hz = 240_000_000

    def __init__(self) -> None:
        self.cycles, self.room, self.link = 0, 1 << 30, True
        self.got: list[tuple[int, bytes]] = []
        self.sent: list[bytes] = []

    def put_frame(self, frame: bytes) -> bool:
        if not self.link or self.room < len(frame):
            return False
        self.room -= len(frame)
        self.got.append((self.cycles, frame))
        return True

    def take_frames(self) -> list[bytes]:
        frames, self.sent = self.sent, []
        return frames

    def set_link(self, up: bool) -> None:
        self.link = up


class Far:
    """The other end."""

    def __init__(self) -> None:
        self.comes: list[bytes] = []
        self.got: list[bytes] = []
        self.now_ns = -1

    def send(self, frame: bytes) -> None:
        self.got.append(frame)

    def receive(self, now_ns: int) -> list[bytes]:
        self.now_ns = now_ns
        frames, self.comes = self.comes, []
        return frames

    def close(self) -> None:
        pass


def test_a_cable_carries_100_mbit_s() -> None:
    """Preamble, check sequence and gap included: 1514 bytes take 123.04 us."""
    chip, far = Chip(), Far()
    cable = Cable(chip, far)
    far.comes = [bytes((n,)) * 1514 for n in range(100)]
    while len(chip.got) < 100:
        chip.cycles += 24_000  # 0.1 ms
        cable.carry()
    assert [frame[0] for _, frame in chip.got] == list(range(100)) and cable.lost == 0
    for n, (cycle, _) in enumerate(chip.got):
        assert 0 <= cycle / 240 - (n + 1) * 123.04 <= 100.1, n
    assert far.now_ns == chip.cycles * 1000 // 240


def test_what_a_chip_has_no_room_for_is_lost() -> None:
    chip, far = Chip(), Far()
    cable = Cable(chip, far)
    chip.room, far.comes = 3000, [bytes(1500)] * 3
    chip.cycles = 240_000
    cable.carry()
    assert len(chip.got) == 2 and cable.lost == 1


def test_a_cable_that_is_out_carries_nothing() -> None:
    chip, far = Chip(), Far()
    cable = Cable(chip, far)
    cable.plug(False)
    chip.sent, far.comes = [b"x"], [bytes(60)]
    chip.cycles = 240_000
    cable.carry()
    assert not chip.link and not chip.got and not far.got
    cable.plug(True)
    chip.sent, far.comes = [b"y"], [bytes(61)]
    chip.cycles = 480_000
    cable.carry()
    assert chip.link and [len(frame) for _, frame in chip.got] == [61] and far.got == [b"y"]


# ---- TAP ----


@pytest.mark.parametrize("name", ["", "a" * 16, "a/b"])
def test_names_that_no_device_has(name: str) -> None:
    with pytest.raises(ServeError, match="is not the name of a TAP device"):
        tap.TapNetwork(name)


IN_A_NAMESPACE = """
import socket, subprocess, sys
from wificnc_chips.tap import TapNetwork
network = TapNetwork("wificnc0")
for command in ("addr add 10.9.0.1/24 dev wificnc0", "link set wificnc0 up"):
    subprocess.run(["ip", *command.split()], check=True)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
    sender.sendto(b"hello", ("10.9.0.2", 9))
    frames = []
    while not any(frame[12:14] == b"\\x08\\x06" and frame[38:42] == bytes((10, 9, 0, 2)) for frame in frames):
        frames += network.receive(0)
    (asked,) = [frame for frame in frames if frame[38:42] == bytes((10, 9, 0, 2))][:1]
    own = bytes.fromhex("0208dc010203")
    network.send(asked[6:12] + own + asked[12:20] + b"\\0\\2" + own + asked[38:42] + asked[22:32])
    while not any(frame[:6] == own and frame[42:47] == b"hello" for frame in frames):
        frames += network.receive(0)
network.close()
print("carried")
"""


def test_a_tap_device_carries_frames() -> None:
    """In a network of its own, so that this computer's does not change."""
    python = "unshare", "--user", "--map-root-user", "--net", sys.executable, "-c"
    run = subprocess.run([*python, IN_A_NAMESPACE], capture_output=True, text=True, timeout=HANG_S, check=False)
    if "unshare" in run.stderr or not Path(tap.DEVICE).exists():
        pytest.skip(f"no namespace of users and networks here: {run.stderr}")
    assert run.stdout == "carried\n", run.stderr
