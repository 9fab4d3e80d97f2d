"""The sending end of a stream: every segment gets there once, whatever the network does. No socket, no clock."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby

from wificnc.connection.wmc3.layout import (
    ASK_MS,
    MOTION_SEGMENTS_MAX,
    RESEND_MS,
    Refusal,
    Segment,
    SegmentFlag,
    State,
    StreamAck,
    StreamSegments,
)  # fmt: skip
from wificnc.connection.wmc3.remedies import REMEDIES
from wificnc.errors import RefusedError

RESEND_S = RESEND_MS / 1000  # a segment that was not acknowledged in this time is sent again
ASK_S = ASK_MS / 1000  # nothing to send: ask how far it is


class StreamSender:
    """Segments in, payloads of datagrams out.

    poll(now) gives what to send now; put every stream_ack into take(). now is any clock in seconds that never goes
    back. Segments that no one will need again are forgotten.
    """

    def __init__(self, stream: int, capacity: int, resend_s: float = RESEND_S, ask_s: float = ASK_S) -> None:
        self.stream = stream
        self.next = 0  # all before it are with the device
        self.done = 0  # all before it are executed
        self.end = 0  # segments put so far
        self.underruns = 0
        self.is_held = False  # in a feed hold, or its door is open
        self.sent = 0  # datagrams
        self._limit = capacity  # segments before it have room there
        self._resend_s = resend_s
        self._ask_s = ask_s
        self._waiting: dict[int, Segment] = {}  # put and not taken
        self._sent_at: dict[int, float] = {}
        self._last_s = float("-inf")

    @property
    def backlog(self) -> int:
        """Segments that the device has not taken."""
        return len(self._waiting)

    @property
    def is_executed(self) -> bool:
        return self.done == self.end

    def put(self, segments: Iterable[Segment], last: bool = False) -> None:
        """Append. @param last: nothing follows for now, so the device is not underrun when it follows it."""
        for segment in segments:
            self._waiting[self.end] = segment
            self.end += 1
        newest = self._waiting.get(self.end - 1)
        if last and newest and self.end - 1 not in self._sent_at:
            self._waiting[self.end - 1] = replace(newest, flags=newest.flags | SegmentFlag.LAST)

    def poll(self, now: float) -> list[tuple[StreamSegments, tuple[Segment, ...]]]:
        """Datagrams to send now."""
        due = [
            number
            for number in sorted(self._waiting)
            if number < self._limit and now - self._sent_at.get(number, float("-inf")) >= self._resend_s
        ]
        datagrams = []
        for first, run in _runs(due):
            datagrams.append((StreamSegments(self.stream, first, len(run)), tuple(self._waiting[n] for n in run)))
            self._sent_at.update(dict.fromkeys(run, now))
        if not datagrams and not self.is_executed and now - self._last_s >= self._ask_s:
            datagrams.append((StreamSegments(self.stream, self.next, 0), ()))
        if datagrams:
            self._last_s = now
        self.sent += len(datagrams)
        return datagrams

    def take(self, ack: StreamAck) -> None:
        """Raises RefusedError when the device takes no more of this stream; next and done say how far it came."""
        if ack.stream != self.stream:
            return
        self.next, self.done = max(self.next, ack.next), max(self.done, ack.done)
        self.underruns = max(self.underruns, ack.underruns)
        self._limit = max(self._limit, ack.next + ack.free)
        self.is_held = ack.state == State.HOLD
        taken = [n for n in self._waiting if n < self.next or (n >= ack.next and _bit(ack.taken, n - ack.next))]
        for number in taken:
            del self._waiting[number]
            self._sent_at.pop(number, None)
        if ack.refusal != Refusal.NONE:
            raise RefusedError(
                f"the device refused the stream: {Refusal(ack.refusal).name.lower()}, segment {ack.refused}; "
                f"{self.done} of {self.end} were executed",
                hint=REMEDIES[Refusal(ack.refusal)],
            )


def _bit(bits: bytes, index: int) -> bool:
    return index < 8 * len(bits) and bool(bits[index // 8] >> index % 8 & 1)


def _runs(numbers: list[int]) -> Iterator[tuple[int, list[int]]]:
    """Consecutive numbers together, at most a packet's worth: the first, and all of them."""
    for _, group in groupby(enumerate(numbers), key=lambda pair: pair[1] - pair[0]):
        run = [number for _, number in group]
        for at in range(0, len(run), MOTION_SEGMENTS_MAX):
            yield run[at], run[at : at + MOTION_SEGMENTS_MAX]
