"""The other end of a serving controller: connections whose every wait ends, and a plain character-counting streamer."""

from __future__ import annotations

import os
import re
import select
import socket
import termios
import time
import tty
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from patience import HANG_S
from wificnc.simulator.serve.server import Server

RX_BYTES = 2048  # what the controller's receive buffer holds: in flight at most

Serve = Callable[..., Server]  # the fixture that starts a controller


class Peer:
    """A connection to the controller. Every wait has a cap; what does not come fails the test."""

    def __init__(self, fd: int, sock: socket.socket | None = None, line_end: bytes = b"\r\n") -> None:
        self._fd = fd
        self._line_end = line_end
        self._sock = sock
        self._rest = b""
        self._lines: deque[str] = deque()

    @classmethod
    def tcp(cls, address: str, line_end: bytes = b"\r\n") -> Peer:
        host, _, port = address.rpartition(":")
        sock = socket.create_connection((host.strip("[]"), int(port)), HANG_S)
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return cls(sock.fileno(), sock, line_end)

    @classmethod
    def serial(cls, link: Path) -> Peer:
        fd = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(fd, termios.TCSANOW)
        return cls(fd)

    def close(self) -> None:
        if self._sock:
            self._sock.close()
        else:
            os.close(self._fd)

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def name(self) -> str:
        """How the controller calls this connection."""
        assert self._sock
        host, port = self._sock.getsockname()[:2]
        return f"{host}:{port}"

    def fileno(self) -> int:
        return self._fd

    def send(self, text: str | bytes) -> None:
        """All of it, before the cap."""
        data = text.encode("latin-1") if isinstance(text, str) else text
        end = time.monotonic() + HANG_S
        while data:
            data = data[self.send_some(data) :]
            if data:
                self._wait(write=True, end=end)

    def send_some(self, data: bytes) -> int:
        """As much as goes in one call."""
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0

    def send_end(self) -> None:
        """Nothing more comes from here, but we still listen."""
        assert self._sock
        self._sock.shutdown(socket.SHUT_WR)

    def line(self, cap_s: float = HANG_S) -> str:
        """The next line that is not empty."""
        end = time.monotonic() + cap_s
        while not self._lines:
            self._wait(write=False, end=end)
            assert self.hear(), "the controller has closed the connection"
        return self._lines.popleft()

    def hear(self) -> bool:
        """Take in what is there. False at the connection's end."""
        try:
            data = os.read(self._fd, 1 << 16)
        except BlockingIOError:
            return True
        except ConnectionResetError:
            return False
        *lines, self._rest = (self._rest + data).split(self._line_end)
        self._lines.extend(line.decode("latin-1") for line in lines if line)
        return data != b""

    def heard(self) -> list[str]:
        """Lines that are there already."""
        lines = [*self._lines]
        self._lines.clear()
        return lines

    def until(self, pattern: str, cap_s: float = HANG_S) -> list[str]:
        """Lines up to one that matches, that one included."""
        end = time.monotonic() + cap_s
        lines: list[str] = []
        while not lines or not re.search(pattern, lines[-1]):
            assert time.monotonic() < end, f"no {pattern!r} in {lines[-20:]}"
            lines.append(self.line(end - time.monotonic()))
        return lines

    def until_closed(self) -> list[str]:
        """Everything up to the connection's end."""
        end = time.monotonic() + HANG_S
        while self.hear():
            self._wait(write=False, end=end)
        return self.heard()

    def ask(self, line: str) -> list[str]:
        """Send a line. Returns all up to its answer, without status reports, which may be another client's."""
        self.send(line + "\n")
        return [said for said in self.until(r"^(ok|error:\d+)$") if not said.startswith("<")]

    def status(self) -> str:
        """Of now, also where reports that others have asked for wait here."""
        self.hear()
        self._lines = deque(line for line in self._lines if not line.startswith("<"))
        self.send("?")
        return self.until("^<")[-1]

    def idle_position_mm(self, cap_s: float = HANG_S) -> list[float]:
        """MPos, once the machine is idle."""
        end = time.monotonic() + cap_s
        while not (report := self.status()).startswith("<Idle"):
            assert time.monotonic() < end, report
        found = re.search(r"MPos:([-\d.,]+)", report)
        assert found, report
        return [float(number) for number in found[1].split(",")]

    def _wait(self, write: bool, end: float) -> None:
        left = end - time.monotonic()
        ready = select.select([self._fd], [self._fd] if write else [], [], max(0.0, left))
        assert ready[0] or ready[1], "nothing happened before the cap"


def stream(peer: Peer, lines: Sequence[str], in_flight: int = RX_BYTES) -> list[str]:
    """Stream by character counting: never more unanswered bytes than the controller can hold. @return every answer."""
    answers: list[str] = []
    waiting: deque[int] = deque()
    flying = 0
    for line in lines:
        size = len(line) + 1
        while flying + size > in_flight:
            flying -= _take_answer(peer, answers, waiting)
        peer.send(line + "\n")
        waiting.append(size)
        flying += size
    while waiting:
        _take_answer(peer, answers, waiting)
    return answers


def _take_answer(peer: Peer, answers: list[str], waiting: deque[int]) -> int:
    line = peer.line()
    if line != "ok" and not line.startswith("error:"):
        return 0
    answers.append(line)
    return waiting.popleft()


def pour(peer: Peer, lines: Iterable[str]) -> list[str]:
    """Send everything as fast as it goes, reading all the while. @return every answer."""
    texts = list(lines)
    data = memoryview("".join(f"{text}\n" for text in texts).encode("latin-1"))
    answers: list[str] = []
    end = time.monotonic() + HANG_S
    while len(answers) < len(texts):
        peer._wait(write=len(data) > 0, end=end)
        data = data[peer.send_some(bytes(data[:65536])) :]
        assert peer.hear(), "the controller has closed the connection"
        answers += [line for line in peer.heard() if line == "ok" or line.startswith("error:")]
    return answers


def connect(server: Server) -> Peer:
    assert server.tcp
    return Peer.tcp(server.tcp)


SLOW = 0.05  # of real time: what must happen within a second of motion has 20 s, however busy the computer is


def clock(server: Server, speed: float) -> None:
    """The machine's time from now on, as a part of real time."""
    with Peer.tcp(server.control or "", line_end=b"\n") as hands:
        hands.send(f"speed {speed:g}\n")
        assert hands.line() == "ok"


def serial(server: Server) -> Peer:
    assert server.options.pty
    return Peer.serial(server.options.pty)
