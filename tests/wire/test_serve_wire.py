"""The binary protocol over real sockets: `wificnc serve --wmc3` and `wificnc wmc3`."""

from __future__ import annotations

import json
import os
import resource
import socket
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from patience import HANG_S, wait_until
from slow import deep_but
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device, find_devices
from wificnc.connection.wmc3.layout import (
    CONTROL_PORT,
    UDP_PORT,
    ConfigGet,
    ConfigSave,
    ConfigSet,
    Handshake,
    IoControl,
    Jog,
    Motion,
    Ping,
    Pong,
    Segment,
    State,
    Statistics,
    StatisticsResponse,
    StreamOpen,
)
from wificnc.connection.wmc3.packet import build, parse
from wificnc.errors import LinkError, RefusedError, ServeError, UserError
from wificnc.simulator.serve.options import ServeOptions, parse_wmc3
from wificnc.simulator.serve.server import Server

# the ports are fixed: every run of the tests has an address of its own
ADDRESS = f"127.58.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"
STRANGER = "127.0.0.66"
FILES = 4096
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))

try:
    socket.create_server((ADDRESS, 0)).close()
except OSError:  # where 127.0.0.1 is the only address of this kind
    ADDRESS = "127.0.0.1"


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    with ExitStack() as stack:

        def start(variant: str = "release", **options: Any) -> Server:
            every = {"board": load_board("host"), "wmc3": ADDRESS, "settings": SETTINGS, **options}
            return stack.enter_context(Server(ServeOptions(**every), variant))

        yield start


def invoke(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(root, ["wmc3", arguments[0], "--to", ADDRESS, *arguments[1:]])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == code, result.output
    return result.output


def position(device: Device) -> tuple[int, ...]:
    report = next(device.reports(HANG_S))
    return report.position_steps


def test_every_command(serve: Callable[..., Server], tmp_path: Path) -> None:
    serve(store=tmp_path / "store")
    hello = json.loads(invoke("handshake", "--json"))
    assert hello["axes"] == len(load_board("host").axes) and "stream" in hello["capabilities"]
    assert "device" in invoke("handshake")
    assert json.loads(invoke("motion", "X=1500", "Y=-750", "--speed", "10000", "--json"))["executed"] == 15
    assert json.loads(invoke("status", "--json"))["position_steps"][:3] == [1500, -750, 0]
    assert "idle X+1500 Y-750" in invoke("status", "0.2")
    assert json.loads(invoke("config", "max_rate_mm_min.y", "10000", "--save", "--json")) == {
        "max_rate_mm_min.y": 10000
    }
    assert json.loads(invoke("config", "0x0011", "--json")) == {"max_rate_mm_min.y": 10000}
    assert len(json.loads(invoke("config", "--json"))) == 113
    assert json.loads(invoke("counters", "--json"))["done"] == 15
    invoke("jog", "--", "Z", "-1000", "0.2")
    with Device(ADDRESS) as device:
        wait_until(lambda: next(device.reports(HANG_S)).state == State.IDLE, "the jog ends")
        assert position(device)[2] < -100
    invoke("hold")
    invoke("resume")
    invoke("estop")
    assert json.loads(invoke("status", "--json"))["state"] == "estop"
    with pytest.raises(RefusedError, match="stream_open: locked"):
        invoke("motion", "X=10")
    invoke("reset")
    assert json.loads(invoke("status", "--json"))["state"] == "idle"
    assert "round_trip_median_ms" in invoke("bench", "--requests", "50")
    with pytest.raises(RefusedError, match="no_homing"):
        invoke("home", "XY")
    with pytest.raises(RefusedError, match="range"):
        invoke("config", "status_interval_ms", "5")
    with pytest.raises(RefusedError, match="unknown key"):
        invoke("config", "nonsense")
    with pytest.raises(RefusedError, match="is not a value"):
        invoke("config", "status_interval_ms", "fast")
    with pytest.raises(UserError, match="not an axis"):
        invoke("motion", "Q=1")


def test_discovery(serve: Callable[..., Server]) -> None:
    serve()
    address, status = next(find_devices(HANG_S, ADDRESS))
    assert (address, status.state) == (ADDRESS, State.IDLE)
    assert len(list(find_devices(0.3, ADDRESS))) <= 1, "each once"


def test_an_access_key(serve: Callable[..., Server]) -> None:
    serve(key="a secret")
    with pytest.raises(RefusedError, match="authentication"):
        invoke("motion", "X=10")
    with pytest.raises(RefusedError, match="authentication"):
        invoke("motion", "X=10", "--key", "a guess")
    assert json.loads(invoke("motion", "X=10", "--key", "a secret", "--json"))["executed"] == 1


@pytest.mark.slow
def test_a_right_proof_among_wrong_ones_has_its_turn(serve: Callable[..., Server]) -> None:
    """The wait of a guesser's address delays the right one; it does not refuse it."""
    serve(key="a secret", speed=4.0)
    with Device(ADDRESS, "a guess") as guesser, Device(ADDRESS, "a secret") as owner:
        for _ in range(3):
            with pytest.raises(RefusedError, match="authentication"):
                guesser.command(ConfigSave())
            guesser.__exit__(None, None, None)
            guesser.__init__(ADDRESS, "a guess")  # type: ignore[misc]
        owner.command(ConfigSave())


def test_silent_connections_shut_no_host_out(serve: Callable[..., Server]) -> None:
    serve(speed=20.0)
    with ExitStack() as stack:
        crowd = [
            stack.enter_context(socket.create_connection((ADDRESS, CONTROL_PORT), HANG_S, (STRANGER, 0)))
            for _ in range(8)
        ]
        device = stack.enter_context(Device(ADDRESS))
        device.request(Ping(1), Pong)
        for one in crowd:
            one.settimeout(HANG_S)
            assert is_ended(one)  # the first ones for the last, and these because they say nothing
        assert device.request(Ping(2), Pong) == Pong(2)


def test_a_second_device_at_the_same_address_is_told(serve: Callable[..., Server]) -> None:
    serve()
    with pytest.raises(ServeError, match="ports of the binary protocol are in use"):
        serve()


def test_addresses_and_speeds_that_cannot_be() -> None:
    assert parse_wmc3("127.0.0.1", 1.0) == "127.0.0.1"
    with pytest.raises(UserError, match="not an IPv4 address"):
        parse_wmc3("localhost", 1.0)
    with pytest.raises(UserError, match="needs a clock"):
        parse_wmc3("127.0.0.1", 0.0)


@pytest.mark.parametrize("address", ["controller", "::1", ""])
def test_an_address_that_is_none(address: str) -> None:
    with pytest.raises(UserError, match="is not an IPv4 address"):
        Device(address)


def test_nobody_there() -> None:
    with Device("127.59.58.99", timeout_s=0.2) as device, pytest.raises(LinkError, match="no device at"):
        device.handshake()


def framed(*packets: bytes) -> bytes:
    return b"".join(struct.pack("<H", len(data)) + data for data in packets)


def connection() -> socket.socket:
    return socket.create_connection((ADDRESS, CONTROL_PORT), HANG_S)


def is_ended(client: socket.socket) -> bool:
    """The other end has closed it; with bytes left unread that is a reset."""
    try:
        return client.recv(10) == b""
    except ConnectionResetError:
        return True


@pytest.mark.parametrize("variant", deep_but("release".__eq__, ["release", "asan"]))
def test_misbehaving_clients_hold_nobody_up(serve: Callable[..., Server], variant: str) -> None:
    """Half messages, sizes that cannot be, clients that never read: others are served."""
    serve(variant)
    with connection() as half, connection() as deaf:
        half.sendall(b"\x20")
        deaf.setblocking(False)
        request = framed(build(ConfigGet(key=1)))
        with pytest.raises(BlockingIOError):
            for _ in range(100_000):
                deaf.sendall(request * 10)
    for size in (0, 257, 65535):
        with connection() as wrong:
            wrong.sendall(struct.pack("<H", size) + bytes(300))
            assert is_ended(wrong)
    with Device(ADDRESS) as device:
        wait_until(lambda: _answers(device), "a good client is served")


@pytest.fixture
def many_files() -> Iterator[None]:
    """More than a thousand sockets at the same time in this process, where the system lets it."""
    before, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    if before != resource.RLIM_INFINITY and before < FILES:
        if most != resource.RLIM_INFINITY and most < FILES:
            pytest.skip(f"no more than {most} open files here")
        resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, most))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (before, most))


def misbehave(client: socket.socket, way: int) -> None:
    """One way of many. All places are taken, so the server may have closed it before."""
    request = framed(build(ConfigGet(key=1)))
    client.setblocking(False)
    with suppress(BlockingIOError, ConnectionError):
        if way == 1:
            client.send(request[:1])  # half a size
        elif way == 2:
            client.send(request[:-1])  # half a message
        elif way == 3:
            client.send(request * 1000)  # and it never reads
        elif way == 4:
            client.send(b"GET / HTTP/1.1\r\n\r\n")
        elif way == 5:
            client.shutdown(socket.SHUT_WR)  # half-open
        elif way == 6:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()  # reset
        elif way == 7:
            client.send(framed(build(StreamOpen())))


def resources(server: Server) -> tuple[int, int]:
    """Memory of the server, KiB, and its open files."""
    status = Path(f"/proc/{server.pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]), len(list(Path(f"/proc/{server.pid}/fd").iterdir()))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="Linux tells it there")
@pytest.mark.parametrize(("count", "variant"), [(200, "release"), pytest.param(1000, "asan", marks=pytest.mark.deep)])
def test_many_connections(serve: Callable[..., Server], many_files: None, count: int, variant: str) -> None:
    """Beyond four they are closed immediately: the four are served, nothing is kept, nothing moves."""
    server = serve(variant)
    with ExitStack() as stack:
        four = [stack.enter_context(Device(ADDRESS)) for _ in range(4)]
        for device in four:
            device.handshake()
        memory, files = resources(server)
        for number in range(count):
            misbehave(stack.enter_context(connection()), number % 8)
            if number % 100 == 99:
                assert [device.request(Ping(number), Pong) for device in four] == [Pong(number)] * 4
        wait_until(lambda: resources(server)[1] == files, "all of them are closed")
        assert [device.request(Ping(1), Pong) for device in four] == [Pong(1)] * 4
        assert resources(server)[0] < memory + 1024, "KiB"
        counts = four[0].request(Statistics(), StatisticsResponse)
        assert (counts.segments, counts.owner) == (0, bytes(4))
        assert position(four[0]) == (0,) * 6
    with Device(ADDRESS) as device:
        wait_until(lambda: _answers(device), "there is room again")


def _answers(device: Device) -> bool:
    try:
        return device.request(Ping(7), Pong) == Pong(7)
    except LinkError:
        device.__exit__(None, None, None)
        device.__init__(ADDRESS)  # type: ignore[misc]
        return False


def test_pipelined_requests_are_answered_in_order(serve: Callable[..., Server]) -> None:
    serve()
    with connection() as client:
        client.sendall(framed(*(build(Ping(number), number) for number in range(200))))
        data = b""
        while len(data) < 200 * 24:
            data += client.recv(65536)
    replies = [parse(data[at + 2 : at + 24]) for at in range(0, len(data), 24)]
    assert [reply.payload for reply in replies if reply] == [Pong(number) for number in range(200)]


def test_a_flood_of_datagrams_moves_nothing_and_ends(serve: Callable[..., Server]) -> None:
    serve()
    good = build(Motion(count=1), 1, 1, [Segment((10, 0, 0, 0, 0, 0), 10_000)])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood, Device(ADDRESS) as device:
        for n in range(20_000):
            flood.sendto(bytes([*good[:16], n & 0xFF, n >> 8 & 0x7F, *good[18:-1], 1]), (ADDRESS, UDP_PORT))
        assert device.request(Ping(1), Pong) == Pong(1)
        assert position(device) == (0,) * 6

        def moves() -> bool:
            device.post(Jog(0, 1, 1000))  # again and again: the flood may still fill the socket's buffer
            return position(device)[0] > 0

        wait_until(moves, "a good datagram still counts")


def test_a_host_that_never_reads_its_acks(serve: Callable[..., Server]) -> None:
    """As LinuxCNC's component of other firmwares connects: handshake, 34 sets and a save without a look at the answers,
    then full-length motion packets and outputs a hundred times a second. All of it takes effect."""
    serve()
    sets = [(0x0100, 1, 5), (0x0101, 1, 5), (0x0300, 0, 0), (0x0301, 0, 2), (0x0310, 0, 0x3F), (0x0400, 1, 0)]
    sets += [(0x0010 + joint, 2, 15_000 + joint) for joint in range(3)]
    with connection() as client, Device(ADDRESS) as device:
        client.sendall(framed(build(Handshake(0x01010000, "LinuxCNC WiFi CNC"), 1)))
        for number, (key, kind, value) in enumerate(sets * 3):
            client.sendall(framed(build(ConfigSet(key, kind, struct.pack("<I", value).ljust(64, b"\0")), number)))
        client.sendall(framed(build(ConfigSave(), 99)))
        wait_until(lambda: device.get(0x0012) == 15_002, "the last set is in force")
        assert (device.get(0x0100), device.get(0x0301)) == (5, 2)
        for _ in range(50):
            device.post(IoControl())
            device.post(Motion(count=1), [Segment((20, 0, 0, 0, 0, 0), 10_000), *[Segment()] * 7])
            time.sleep(0.01)
        wait_until(lambda: position(device)[0] == 1000, "every step was made")


def control(server: Server, line: str) -> str:
    """What the hands at the module get."""
    assert server.control
    host, port = server.control.rsplit(":", 1)
    with socket.create_connection((host, int(port)), HANG_S) as connection, connection.makefile("rw") as file:
        file.write(line + "\n")
        file.flush()
        return file.readline().strip()


def test_an_io_module(serve: Callable[..., Server]) -> None:
    server = serve(io_module=True, control=0)
    assert json.loads(invoke("handshake", "--json"))["io_channels"] == 16
    made = json.loads(invoke("channel", "3", "--output", "--pin", "20", "--invert", "--json"))
    assert made == {
        "number": 3, "direction": "output", "pin": 20, "pull_up": True, "invert": True, "fault": False, "on": False,
    }  # fmt: skip
    with pytest.raises(RefusedError, match="config_save: pin"):
        invoke("channel", "4", "--pin", "20")
    assert json.loads(invoke("channel", "4", "--json"))["pin"] == 4, "as it was"
    assert control(server, "pin 0 low") == "ok" and control(server, "pin 64 low").startswith("error")
    assert control(server, "pins") == f"driven 0x{1 << 20:016x} level 0x{1 << 20:016x}"
    invoke("config", "io_link_lost", "0")
    invoke("output", "3", "on")
    assert control(server, "pins").endswith("level 0x0000000000000000")
    with Device(ADDRESS) as device:
        wait_until(lambda: next(device.reports(HANG_S)).io_inputs == 0xFFF6, "channel 0 is low")
    report = json.loads(invoke("status", "--json"))
    assert [channel["number"] for channel in report["channels"] if channel["on"]] == [1, 2, *range(3, 16)]
    assert "output" in invoke("status") and "channel" in invoke("channel", "3")
    with pytest.raises(RefusedError, match="not_output"):
        invoke("output", "0", "on")
    with pytest.raises(RefusedError, match="io_module"):
        invoke("motion", "X=10")
    with pytest.raises(UserError, match="unknown channel 16"):
        invoke("output", "16", "on")
    assert server.tcp is None


def keep_alive_timers(port: int) -> list[bool]:
    """Of the connections of this device: does the kernel ask for signs of life?"""
    address = bytes(reversed(socket.inet_aton(ADDRESS))).hex().upper()
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return [row[5].startswith("02") for row in rows if row[1] == f"{address}:{port:04X}" and row[3] == "01"]


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="Linux tells it there")
@pytest.mark.parametrize("io_module", [True, False])
def test_a_host_that_went_without_a_word_is_noticed(serve: Callable[..., Server], io_module: bool) -> None:
    serve(io_module=io_module)
    with Device(ADDRESS) as device:
        device.handshake()
        assert keep_alive_timers(CONTROL_PORT) == [True], "else its jog and its spindle would never end"


def test_a_stored_mode_is_that_of_the_next_start(serve: Callable[..., Server], tmp_path: Path) -> None:
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, store=tmp_path / "store")):
        invoke("config", "device_mode", "1", "--save")
    serve(store=tmp_path / "store", settings=())
    assert json.loads(invoke("handshake", "--json"))["capabilities"] == ["io_module"]
