"""A stream without end, and the other end of a door: every line answered once, in order, and nowhere else to be.

Moves are relative, so that a line lost, doubled or cut short shows in the last position, to the step.
"""

from __future__ import annotations

import os
import re
import select
import socket
import termios
import time
import tty
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

WRONG_EVERY = 997  # a prime: the wrong lines fall on every kind of line
GRID_MM = 0.004  # all moves are multiples of this: one step of 250 a mm
SILENCE_S = 10.0  # this long without an answer is not an answer
CHUNK = 1 << 16
ANSWER = re.compile(r"ok|error:\d+")


class StreamError(Exception):
    """What came was not what had to come."""


@dataclass(frozen=True)
class Program:
    """Lines, their answers, and where they end in units of GRID_MM."""

    lines: tuple[str, ...]
    answers: tuple[str, ...]
    end: tuple[int, int, int]

    def end_mm(self) -> tuple[float, ...]:
        return tuple(round(steps * GRID_MM, 3) for steps in self.end)


def program(count: int) -> Program:
    """Short relative moves of three axes, and a wrong line now and then."""
    lines, answers = ["G21G91G94G1F5000"], ["ok"]
    end = [0, 0, 0]
    for n in range(1, count):
        if n % WRONG_EVERY == 0:
            lines.append("G1X1X2")
            answers.append("error:25")
            continue
        move = (n * 7 % 61 - 29, n * 5 % 53 - 26, n * 3 % 17 - 8)
        lines.append("X{:.3f}Y{:.3f}Z{:.3f}".format(*(steps * GRID_MM for steps in move)))
        answers.append("ok")
        end = [at + steps for at, steps in zip(end, move, strict=True)]
    return Program(tuple(lines), tuple(answers), (end[0], end[1], end[2]))


class Door:
    """A connection by TCP, or a serial device."""

    def __init__(self, address: str | Path) -> None:
        self._socket: socket.socket | None = None
        if isinstance(address, Path):
            self._fd = os.open(address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            tty.setraw(self._fd, termios.TCSANOW)
        else:
            host, _, port = address.rpartition(":")
            self._socket = socket.create_connection((host.strip("[]"), int(port)), SILENCE_S)
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._fd = self._socket.fileno()
        self._rest = b""

    def __enter__(self) -> Door:
        return self

    def __exit__(self, *_: object) -> None:
        if self._socket:
            self._socket.close()
        else:
            os.close(self._fd)

    def fileno(self) -> int:
        return self._fd

    def write(self, data: bytes | memoryview) -> int:
        """As much as goes in one call."""
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0

    def lines(self) -> list[str]:
        """Whole lines that are there; () immediately when none are. Raises StreamError at the end."""
        try:
            data = os.read(self._fd, CHUNK)
        except BlockingIOError:
            return []
        if not data:
            raise StreamError("the controller has closed the connection")
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [line.rstrip(b"\r").decode("latin-1") for line in lines]

    def wait(self, write: bool = False, seconds: float = SILENCE_S) -> None:
        """Until something comes, or can be written. Raises StreamError."""
        ready = select.select([self._fd], [self._fd] if write else [], [], seconds)
        if not (ready[0] or ready[1]):
            raise StreamError(f"nothing for {seconds:.0f} s")

    def ask(self, text: bytes, begin: str) -> str:
        """Send a few bytes; the first line that begins so."""
        self.write(text)
        while True:
            self.wait()
            for line in self.lines():
                if line.startswith(begin):
                    return line


def pour(door: Door, lines: Sequence[str], answers: Sequence[str]) -> float:
    """Send everything as fast as it goes, and hold each answer against the one it has to be.

    Returns:
        How many seconds it took until the last answer.

    Raises:
        StreamError: the first answer that is missing, wrong, or too much.
    """
    data = memoryview("".join(f"{line}\n" for line in lines).encode("latin-1"))
    begin, at = time.monotonic(), 0
    while at < len(answers):
        door.wait(write=len(data) > 0)
        data = data[door.write(data[:CHUNK]) :]
        for line in door.lines():
            if ANSWER.fullmatch(line) is None:
                continue
            if at == len(answers) or line != answers[at]:
                raise StreamError(f"answer {at + 1} is {line}, to {lines[at] if at < len(lines) else 'nothing'}")
            at += 1
    return time.monotonic() - begin


def rest_mm(door: Door) -> tuple[float, ...]:
    """X Y Z once it is at rest. Raises StreamError: an answer that no one waits for, or it is never at rest."""
    end = time.monotonic() + SILENCE_S
    while time.monotonic() < end:
        report = door.ask(b"?", "<")
        found = re.search(r"^<Idle.*MPos:([-\d.]+),([-\d.]+),([-\d.]+)", report)
        if found:
            return tuple(float(number) for number in found.groups())
    raise StreamError(f"still moving after {SILENCE_S:.0f} s: {report}")
