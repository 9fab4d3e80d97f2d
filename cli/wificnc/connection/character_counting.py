"""Many lines at full speed without ever overrunning the controller: character counting.

    sent ──────────────────────────────► controller's receive buffer ──► line by line ──► ok / error
           under way: sent, not answered

Every byte that is sent and not yet answered may still lie in the controller's receive buffer. Their sum stays within
what the controller advertises; each answer frees the bytes of the oldest line under way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Sendable(Protocol):
    """A line ready for the wire."""

    @property
    def wire(self) -> bytes:
        """With its line end; no real-time bytes."""

    @property
    def alone(self) -> bool:
        """Whether it must meet a controller that has nothing else to do."""


LineT = TypeVar("LineT", bound=Sendable)


@dataclass
class Window:
    """How many bytes may be under way. Two bounds: what the controller was built with, and what it says is free."""

    capacity: int
    under_way: int = 0
    reported: int | None = None

    @property
    def limit(self) -> int:
        return self.capacity if self.reported is None else min(self.capacity, self.reported)

    @property
    def room(self) -> int:
        return self.limit - self.under_way

    def hear_free(self, free: int) -> None:
        """A report says so many bytes are free. Our lines under way fill the rest or less, unless the buffer is
        smaller than we thought or someone else's bytes lie in it: then their room is not ours."""
        self.reported = free + self.under_way


class Streamer(Generic[LineT]):
    """Hands out bytes, takes answers. Knows no link and no clock. No line may be longer than the capacity."""

    def __init__(self, lines: Iterable[LineT], capacity: int) -> None:
        self.window = Window(capacity)
        self.under_way: deque[LineT] = deque()
        self.sent = 0
        self.answered = 0
        self.last_sent: LineT | None = None
        self.last_answered: LineT | None = None
        self._lines: Iterator[LineT] = iter(lines)
        self._next: LineT | None = next(self._lines, None)

    @property
    def all_sent(self) -> bool:
        return self._next is None

    @property
    def done(self) -> bool:
        return self._next is None and not self.under_way

    @property
    def waits_for_rest(self) -> bool:
        """The next line must be alone, and all before it is answered."""
        return self._next is not None and self._next.alone and not self.under_way

    def take(self, at_rest: bool = False) -> bytes:
        """Bytes that may be sent now, and from now on count as sent. at_rest: the machine has nothing to do."""
        data = bytearray()
        while (line := self._next) is not None and self._may_go(line, at_rest):
            at_rest = False
            data += line.wire
            self.window.under_way += len(line.wire)
            self.under_way.append(line)
            self.sent += 1
            self.last_sent = line
            self._next = next(self._lines, None)
        return bytes(data)

    def _may_go(self, line: LineT, at_rest: bool) -> bool:
        if self.under_way and self.under_way[-1].alone:
            return False
        if line.alone:
            return at_rest and not self.under_way
        return len(line.wire) <= self.window.room

    def answer(self) -> LineT | None:
        """An answer came: the line it belongs to, or None when no line is under way."""
        if not self.under_way:
            return None
        line = self.under_way.popleft()
        self.window.under_way -= len(line.wire)
        self.answered += 1
        self.last_answered = line
        return line
