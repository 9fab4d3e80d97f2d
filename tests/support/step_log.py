"""Step events of a trace as they come, and as one array."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from c_library import CONSUMER, EVENT
from numpy.typing import NDArray


class StepLog:
    """.consumer is what trace_add() takes; it lives as long as the log."""

    def __init__(self) -> None:
        self.keep_events = 0  # so many at least, the newest ones; 0: all
        self._parts: list[bytes] = []
        self.consumer: Any = CONSUMER(self._take)

    def _take(self, _ctx: object, events: int, count: int) -> None:
        self._parts.append(ctypes.string_at(events, count * EVENT.itemsize))
        while self.keep_events and sum(map(len, self._parts[1:])) >= self.keep_events * EVENT.itemsize:
            del self._parts[0]

    def clear(self) -> None:
        self._parts.clear()

    def events(self) -> NDArray[np.void]:
        """All since the last clear(). Arrays that came one by one would cost numpy 0.1 ms each to concatenate."""
        self._parts[:] = [b"".join(self._parts)]
        return np.frombuffer(self._parts[0], EVENT)
