"""A job continues next to clients that misbehave all the while: one answer a line, in order, and every step made."""

from __future__ import annotations

import os
import socket
import struct
from collections import deque
from collections.abc import Callable, Iterator
from itertools import count

import pytest
from bench.streams import ANSWER, GRID_MM, Door, rest_mm
from serve_peer import Peer, Serve, connect, serial
from slow import deep_but
from wificnc.simulator.serve.server import Server

IN_FLIGHT = 200  # lines of the job that wait for their answers
WRONG_EVERY = 13
MEGABYTE = 1 << 20
CONNECTIONS = 40

Fault = Callable[[Server], Iterator[None]]


class Job:
    """Lines without end, each of which moves by one step; now and then one that is wrong."""

    def __init__(self, owner: Door) -> None:
        self._owner = owner
        self._numbers = count(1)
        self._expected: deque[str] = deque()
        self._unsent = b"G91G1F3000\n"
        self._expected.append("ok")
        self.moves = 0

    def go_on(self, more: bool) -> bool:
        """Send what goes, hear what is there. False when all is answered."""
        while more and len(self._expected) < IN_FLIGHT:
            self._add(next(self._numbers))
        self._unsent = self._unsent[self._owner.write(self._unsent) :]
        for line in self._owner.lines():
            if ANSWER.fullmatch(line):
                assert self._expected, f"{line} to no line"
                assert line == self._expected.popleft()
        return bool(self._expected)

    def beside(self, fault: Iterator[None]) -> None:
        """As long as the fault continues, and then to the end."""
        more = waits = True
        while more or waits:
            waits = self.go_on(more)
            if more:
                more = next(fault, StopIteration) is None
            elif waits:
                self._owner.wait()

    def _add(self, number: int) -> None:
        wrong = number % WRONG_EVERY == 0
        self._unsent += b"G1X1X2\n" if wrong else b"X0.004\n"
        self._expected.append("error:25" if wrong else "ok")
        self.moves += not wrong


def vanish(peer: Peer) -> None:
    """As if its cable were cut and the other end had noticed: a reset, no goodbye."""
    os_socket = socket.socket(fileno=os.dup(peer.fileno()))
    os_socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()
    os_socket.close()


def pushed(peer: Peer, data: bytes, read: bool = True) -> Iterator[None]:
    """All of it, as it goes, until the controller has enough of this client."""
    while data:
        try:
            data = data[peer.send_some(data[:65536]) :]
        except (BrokenPipeError, ConnectionResetError):
            return
        if read and not peer.hear():
            return
        peer.heard()
        yield


def connections(server: Server) -> Iterator[None]:
    for n in range(CONNECTIONS):
        peer = connect(server)
        peer.send("G0X"[: n % 4])
        yield
        (vanish if n % 2 else Peer.close)(peer)
        yield


def serial_openings(server: Server) -> Iterator[None]:
    for _ in range(CONNECTIONS):
        with serial(server) as peer:
            peer.send_some(b"$$\nG0X")
            yield


def flood_of_lines(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        yield from pushed(peer, b"G0X1\n" * (MEGABYTE // 2), read=False)


def flood_of_questions(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        yield from pushed(peer, b"?" * MEGABYTE, read=False)


def flood_of_resets(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        yield from pushed(peer, b"\x18\x85~" * (MEGABYTE // 3))


def endless_line(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        yield from pushed(peer, b"G1X" + b"7" * MEGABYTE)
        vanish(peer)


def endless_line_at_the_serial_port(server: Server) -> Iterator[None]:
    with serial(server) as peer:
        yield from pushed(peer, b"G1X" + b"7" * MEGABYTE)


def utf8(server: Server) -> Iterator[None]:
    text = "\ufeffG0 X5 ; größer\nприве́т 🛠 $X\n".encode()
    with connect(server) as peer:
        for at in range(200 * len(text)):
            peer.send(text[at % len(text) :][:1])
            if at % 16 == 0:
                peer.hear()
                yield


def telnet_without_end(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        yield from pushed(peer, b"\xff\xfa\x1f" + bytes(range(1, 255)) * 2000)
    with connect(server) as peer:
        yield from pushed(peer, b"\xff\xfb\x01\xff\xfd\x03" * 20_000, read=False)


def says_no_more_and_does_not_read(server: Server) -> Iterator[None]:
    with connect(server) as peer:
        peer.send("G0X1\n?")
        peer.send_end()
        for _ in range(50):
            yield


FAULTS = [
    connections,
    serial_openings,
    flood_of_lines,
    flood_of_questions,
    flood_of_resets,
    endless_line,
    endless_line_at_the_serial_port,
    utf8,
    telnet_without_end,
    says_no_more_and_does_not_read,
]


@pytest.mark.parametrize(("variant", "speed"), [("release", 1.0), pytest.param("asan", 0.0, marks=pytest.mark.deep)])
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_the_job_goes_on(serve: Serve, fault: Fault, variant: str, speed: float) -> None:
    server = serve(speed=speed, variant=variant, pty=True)
    assert server.tcp
    with Door(server.tcp) as owner:
        job = Job(owner)
        while job.go_on(more=False):
            owner.wait()
        job.beside(fault(server))
        assert rest_mm(owner) == (round(job.moves * GRID_MM, 3), 0.0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("variant", deep_but("release".__eq__, ["release", "asan"]))
def test_an_owner_that_is_cut_off(serve: Serve, variant: str) -> None:
    """Its whole lines are run at `~`, its half line is not, and the next one finds a sane controller."""
    server = serve(variant=variant)
    with connect(server) as watcher:
        owner = connect(server)
        owner.send("G0X1\nG0X2")
        watcher.until("commands")
        watcher.until("^ok$")
        vanish(owner)
        watcher.until("No client is in control")
        watcher.send("~")
        assert watcher.ask("G0Y3")[-1] == "ok"
        assert watcher.idle_position_mm()[:2] == [1.0, 3.0]
