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
        self._bytes = b""
        self._parts: list[bytes] = []
        self.consumer: Any = CONSUMER(self._take)

    def _take(self, _ctx: object, events: int, count: int) -> None:
        self._parts.append(ctypes.string_at(events, count * EVENT.itemsize))

    def clear(self) -> None:
        self._bytes = b""
        self._parts.clear()

    def events(self) -> NDArray[np.void]:
        """All since the last clear(). Arrays that came one by one would cost numpy 0.1 ms each to concatenate."""
        if self._parts:
            self._bytes = b"".join([self._bytes, *self._parts])
            self._parts.clear()
        return np.frombuffer(self._bytes, EVENT)
