"""A controller in virtual time with a dial."""

from __future__ import annotations

from typing import Any

import numpy as np
from c_library import LIB
from grbl_host import HZ, Grbl
from numpy.typing import NDArray
from wificnc.simulator.library import HostBoard, Tasks

STEPS_MM = 250.0  # $100 after a first start
COUNTS = 4  # a detent
SELECTS = 8  # HOST_DIAL_SELECTS
REST_S = 0.3  # longer than the hand must rest before it may move something after a refusal


class DialGrbl(Grbl):
    """X, Y and Z, fast axes, and a dial of four counts a detent."""

    def __init__(self, *, selects: bool = False, tasks: Tasks = Tasks.FREE, counts: int = COUNTS) -> None:
        board = HostBoard(
            HZ, 1000, 500, 500_000, 3, digital_inputs=4, digital_outputs=4, toolsetter=1, tasks=tasks,
            dial=counts | SELECTS * selects,
        )  # fmt: skip
        super().__init__(board=board)
        self.after(0.1)
        axes = [f"${base + axis}={value}" for base, value in ((110, 6000), (120, 500)) for axis in range(3)]
        for line in (*axes, "$401=0.1", "$402=1800"):
            assert self.after(0.1, line + "\n") == "ok\r\n", line
        self.after(1.0)
        self.record()

    def status(self) -> str:
        """The answer to ?; a task of a chip takes its time."""
        return self.after(0.05, "?")

    def turn(self, detents: int, per_s: float = 20.0) -> float:
        """Begin to turn. @return how many seconds that takes"""
        LIB.virtual_dial(self._host, detents, per_s)
        return abs(detents) / per_s

    def turned(self, detents: int, per_s: float = 20.0) -> str:
        """Turn, and see it through. @return what the controller said"""
        return self.after(self.turn(detents, per_s) + 1.0)

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Times and positions of X, steps, since record(); it begins at 0."""
        events = self.step_events()
        events = events[(events["step"] & 1) != 0]
        return events["t"] / HZ, np.cumsum(1 - 2 * (events["dir"] & 1).astype(np.int64))

    def x_at(self, t_s: float) -> int:
        times, at = self.edges()
        before = int(np.searchsorted(times, t_s, side="right"))
        return int(at[before - 1]) if before else 0


def make(*lines: str, **how: Any) -> DialGrbl:
    grbl = DialGrbl(**how)
    for line in lines:
        assert grbl.after(0.1, line + "\n") == "ok\r\n", line
    return grbl
