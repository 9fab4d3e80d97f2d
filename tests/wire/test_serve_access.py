"""Who may command by the binary protocol, over real sockets: hosts that know no key, two hosts, and another key."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest
from patience import HANG_S, wait_until
from serve_peer import Peer
from test_serve_wire import ADDRESS, STRANGER, framed, position, serve
from wificnc.connection.wmc3 import device as device_module
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.layout import (
    CONTROL_PORT,
    UDP_PORT,
    Hold,
    IoControl,
    Jog,
    Motion,
    Ping,
    Pong,
    Resume,
    Segment,
    State,
    Statistics,
    StatisticsResponse,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build
from wificnc.errors import LinkError, RefusedError
from wificnc.simulator.serve.options import Address
from wificnc.simulator.serve.server import Server

__all__ = ["serve"]

KEY = "a secret of sixteen"
ELSEWHERE = "127.0.0.67"
MOTION_MS = 10  # of RawHost

pytestmark = pytest.mark.skipif(ADDRESS == "127.0.0.1", reason="127.0.0.1 is the only address of this computer")


class RawHost:
    """A host as upstream's are: it knows neither keys nor seals."""

    def __init__(self) -> None:
        self.number = 0
        self.last = b""

    def send(self, address: str, again: bool = False) -> None:
        """Ten steps of X from this address, or the very bytes of the last time."""
        if not again:
            self.number += 1
            now_us = int(time.monotonic() * 1e6) & 0xFFFFFFFF
            self.last = build(Motion(count=1), self.number, now_us, [Segment((10, 0, 0, 0, 0, 0), 1000 * MOTION_MS)])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as raw:
            raw.bind((address, 0))
            raw.sendto(self.last, (ADDRESS, UDP_PORT))


def tell(server: Server, *lines: str) -> None:
    """Log in from the stranger's address, and say these."""
    assert server.tcp
    host, _, port = server.tcp.rpartition(":")
    sock = socket.create_connection((host, int(port)), HANG_S, (STRANGER, 0))
    sock.setblocking(False)
    with Peer(sock.fileno(), sock) as peer:
        for line in (f"$LOGIN={KEY}", *lines):
            assert peer.ask(line)[-1] == "ok"


def at_rest(device: Device) -> bool:
    return next(device.reports(HANG_S)).state == State.IDLE


def settled(device: Device) -> int:
    """X, when all of a motion that was sent before would be done: the answer to a request is behind it, reports of
    before are thrown away, and then the controller's own clock runs for longer than the motion takes."""
    device.request(Statistics(), StatisticsResponse)
    listener = device.listen()
    listener.setblocking(False)
    with suppress(BlockingIOError):
        while True:
            listener.recv(512)
    reports = device.reports(HANG_S)
    begin_ms = next(reports).uptime_ms
    return next(one.position_steps[0] for one in reports if one.uptime_ms - begin_ms > 10 * MOTION_MS)


def test_a_host_that_knows_no_key_moves_from_a_trusted_address_only(serve: Callable[..., Server]) -> None:
    server, host = serve(key=KEY, tcp=Address("127.0.0.1", 0)), RawHost()
    with Device(ADDRESS, KEY) as watcher:
        host.send(STRANGER)
        assert settled(watcher) == 0, "not trusted yet"
        tell(server, "$TRUST=day")
        host.send(STRANGER)
        wait_until(lambda: position(watcher)[0] == 10, "it moves")
        for address in (ELSEWHERE, STRANGER):
            host.send(address, again=True)
            assert settled(watcher) == 10, "the same again, from another address and from its own"
        host.send(ELSEWHERE)
        assert settled(watcher) == 10, "another address"
        tell(server, "$TRUST=no")
        host.send(STRANGER)
        assert settled(watcher) == 10, "not trusted any more"


def test_a_host_that_may_not_command_is_told_how(serve: Callable[..., Server]) -> None:
    serve(key=KEY)
    with Device(ADDRESS) as stranger, pytest.raises(RefusedError) as refused:
        stranger.command(Jog(0, 1, 1000))
    assert "wificnc login" in (refused.value.hint or "")


def test_two_hosts_take_control_from_each_other(serve: Callable[..., Server], monkeypatch: pytest.MonkeyPatch) -> None:
    serve(key=KEY)
    with Device(ADDRESS, KEY) as first:
        monkeypatch.setattr(device_module, "_local_address", lambda _: STRANGER)
        with Device(ADDRESS, KEY) as second, Device(ADDRESS) as third:
            first.command(Jog(0, 1, 1000))
            wait_until(lambda: position(first)[0] > 0, "it jogs")
            with pytest.raises(RefusedError, match="owner"):
                second.command(Jog(1, 1, 1000))
            with pytest.raises(RefusedError, match="authentication"):
                third.take()
            second.take()
            with pytest.raises(RefusedError, match="owner"):
                first.command(Jog(0, 1, 1000))
            wait_until(lambda: at_rest(first), "the jog of the owner of before ends")
            second.command(Jog(1, 1, 1000))
            wait_until(lambda: position(first)[1] > 0, "the new owner jogs")
            first.take()
            wait_until(lambda: at_rest(first), "the second owner's jog ends")
            first.command(Jog(0, -1, 1000))


def test_after_a_restart_with_another_key_nothing_of_before_counts(serve: Callable[..., Server]) -> None:
    """Sessions, proofs and connections of before the key was changed."""
    before = serve(key=KEY)
    with Device(ADDRESS, KEY) as host:
        host.command(Jog(0, 1, 1000))
        wait_until(lambda: position(host)[0] > 0, "it jogs")
        before.stop()
        serve(key="another secret of mine")
        with Device(ADDRESS, "another secret of mine") as owner:
            for _ in range(20):
                host.post(Jog(0, 1, 1000))  # sealed by the session of before
            assert settled(owner) == 0
            with pytest.raises(LinkError):
                host.command(Jog(0, 1, 1000))
            with Device(ADDRESS, KEY) as old, pytest.raises(RefusedError, match="authentication"):
                old.command(Jog(0, 1, 1000))
            owner.command(Jog(0, 1, 1000))


class Crowd:
    """Strangers, each of another address, that take all places that are left to them, and talk."""

    def __init__(self) -> None:
        self.all: list[socket.socket] = []

    def come(self, count: int) -> None:
        for _ in range(count):
            address = f"127.0.1.{len(self.all) + 1}"
            self.all.append(socket.create_connection((ADDRESS, CONTROL_PORT), HANG_S, (address, 0)))
            self.all[-1].setblocking(False)

    def talk(self) -> None:
        for one in self.all:
            with suppress(OSError):
                one.send(framed(build(Ping(1), 1)))


@pytest.fixture
def crowd() -> Iterator[Crowd]:
    made = Crowd()
    yield made
    for one in made.all:
        one.close()


def test_a_crowd_does_not_displace_a_host_whose_motion_waits_in_a_hold(
    serve: Callable[..., Server], crowd: Crowd
) -> None:
    serve(key=KEY, speed=20.0)
    with Device(ADDRESS, KEY) as device:
        reports = device.reports(HANG_S)
        begin_ms = next(reports).uptime_ms
        device.post(Motion(count=8), [Segment((1000, 0, 0, 0, 0, 0), 1_000_000)] * 8)
        while next(reports).position_steps[0] == 0:
            pass
        device.post(Hold())
        crowd.come(3)
        while next(reports).uptime_ms - begin_ms < 40_000:
            crowd.talk()
        crowd.come(4)
        for _ in range(20):
            crowd.talk()
            next(reports)
        device.post(Resume())
        while (now := next(reports)).state != State.IDLE:
            assert now.state in (State.HOLD, State.RUN)
        assert now.position_steps[0] == 8000


def test_a_crowd_does_not_displace_a_host_that_sends_only_datagrams(serve: Callable[..., Server], crowd: Crowd) -> None:
    """Its connection is silent for longer than others may be; but it is what its datagrams are proven by. On a busy
    computer a jog is repeated too late, and ends, rightly; but each one moves."""
    serve(key=KEY, speed=20.0)
    with Device(ADDRESS, KEY) as device:
        device.command(IoControl())
        reports = device.reports(HANG_S)
        first = next(reports)
        now_ms = begin_ms = first.uptime_ms
        crowd.come(3)
        while now_ms - begin_ms < 40_000:
            device.post(Jog(0, 1, 1000))
            crowd.talk()
            now = next(reports)
            now_ms = now.uptime_ms
        assert now.position_steps[0] > first.position_steps[0]
        while now.state != State.IDLE:
            now = next(reports)
        rest = now.position_steps[0]
        crowd.come(4)
        for _ in range(20):
            crowd.talk()
            device.post(Jog(0, 1, 1000))
            now = next(reports)
        assert now.position_steps[0] > rest
        assert device.request(Ping(7), Pong) == Pong(7)
