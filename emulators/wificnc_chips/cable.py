"""The Ethernet cable of a virtual chip: frames between its W5500 and a network."""

from __future__ import annotations

from collections import deque
from typing import Protocol

BIT_HZ = 100_000_000
AROUND = 8 + 4 + 12  # bytes of a frame on the cable that are none of its own: preamble, check sequence, gap
FRAME_MIN = 60
WAITING_MAX = 1000  # frames; a switch keeps no more either
NS_PER_S = 1_000_000_000


class Network(Protocol):
    """What is at the other end."""

    def send(self, frame: bytes) -> None: ...

    def receive(self, now_ns: int) -> list[bytes]: ...

    def close(self) -> None: ...


class Socketed(Protocol):
    """A chip with Ethernet."""

    cpu_hz: int

    @property
    def cycles(self) -> int: ...

    def put_frame(self, frame: bytes) -> bool: ...

    def take_frames(self) -> list[bytes]: ...

    def set_link(self, up: bool) -> None: ...


class Cable:
    """100 Mbit/s towards the chip, in its time. What the chip has no room for is lost, as on its real one."""

    def __init__(self, chip: Socketed, network: Network) -> None:
        self._chip, self._network = chip, network
        self._waiting: deque[bytes] = deque()
        self._free_at = 0.0  # cycle from which the cable is free for the next frame
        self._looked_at = 0  # the cycle of the last look
        self._is_up = True
        self.lost = 0  # frames that the chip did not take

    def carry(self) -> None:
        """All that was sent until now; often, as the chip's buffer holds 1.3 ms of what a cable brings."""
        for frame in self._chip.take_frames():
            if self._is_up:
                self._network.send(frame)
        now = self._chip.cycles
        if not self._waiting:  # what comes now began after the last look
            self._free_at = max(self._free_at, self._looked_at)
        self._looked_at = now
        self._waiting += self._network.receive(now * NS_PER_S // self._chip.cpu_hz)
        self.lost += max(0, len(self._waiting) - WAITING_MAX)
        while len(self._waiting) > WAITING_MAX:
            self._waiting.pop()
        while self._waiting and self._free_at + self._cycles(self._waiting[0]) <= now:
            frame = self._waiting.popleft()
            self._free_at += self._cycles(frame)
            self.lost += not (self._is_up and self._chip.put_frame(frame))

    def _cycles(self, frame: bytes) -> float:
        return (max(len(frame), FRAME_MIN) + AROUND) * 8 / BIT_HZ * self._chip.cpu_hz

    def plug(self, up: bool) -> None:
        """In, or out: then frames of both ways are lost."""
        self._is_up = up
        self._chip.set_link(up)

    def close(self) -> None:
        self._network.close()
