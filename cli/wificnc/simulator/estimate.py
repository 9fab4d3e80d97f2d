"""How long a job takes, from the simulator: the time at which the controller will take each line, and the end.

Streaming and simulation meet at one event, the answer to a line: it comes when the line enters the look-ahead, in the
simulation as on the machine. So what is left when line N is answered is the whole time less the simulated time of that
answer. The simulation runs in a thread of its own while the job already runs; ctypes lets go of Python's lock.
"""

from __future__ import annotations

import ctypes
import threading
from bisect import bisect_right
from collections.abc import Iterable

from wificnc.errors import UserError
from wificnc.job.program import JobLine
from wificnc.simulator.job import simulated_text
from wificnc.simulator.library import HostBoard, Simulation

EVENTS_PER_CALL = 20_000  # about a second of the job between two marks
# The machine's inputs and outputs are not known here: let there be all of them.
PARTS = {"digital_inputs": 8, "analog": 1, "digital_outputs": 5, "encoder": 1, "toolsetter": 1, "spindle_bus": 1}
BOARD = HostBoard(20_000_000, 1000, 500, 200_000, 6, **PARTS)
FASTEST_HZ = 200_000


class Estimate:
    """Times of one job's lines. Starts simulating immediately; stop() ends that."""

    def __init__(
        self, library: ctypes.CDLL, lines: Iterable[JobLine], settings: dict[int, str], axis_count: int
    ) -> None:
        self._library = library
        self._text, _ = simulated_text(b"".join(line.wire for line in lines))
        self._settings = settings
        self._axis_count = axis_count
        self._marks_line = [0]
        self._marks_s = [0.0]
        self._total_s: float | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._simulate, name="estimate", daemon=True)
        self._thread.start()

    @property
    def total_s(self) -> float | None:
        """Of the whole job; None = not known (yet)."""
        return self._total_s

    def remaining_s(self, answered: int, since_s: float = 0.0) -> float | None:
        """What is left, this long after so many lines were answered; None = not known (yet)."""
        if self._total_s is None:
            return None
        is_last = answered >= self._marks_line[-1]
        following_s = self._total_s if is_last else self.time_of(answered + 1)
        return max(0.0, self._total_s - min(self.time_of(answered) + since_s, following_s))

    def time_of(self, answered: int) -> float:
        """When the simulated controller had answered so many lines."""
        i = bisect_right(self._marks_line, answered) - 1
        line, at = self._marks_line[i], self._marks_s[i]
        if i + 1 == len(self._marks_line):
            return at
        share = (answered - line) / (self._marks_line[i + 1] - line)
        return at + share * (self._marks_s[i + 1] - at)

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()

    def wait(self, timeout_s: float) -> bool:
        """Until the whole time is known. @return whether it is"""
        self._thread.join(timeout_s)
        return self._total_s is not None

    def _simulate(self) -> None:
        """What a simulation cannot do leaves the time unknown: it is a comfort, never a reason to stop a job."""
        timing = (BOARD.timer_hz, BOARD.step_pulse_ns, BOARD.dir_setup_ns, FASTEST_HZ)
        board = HostBoard(*timing, self._axis_count, **PARTS)
        try:
            with Simulation(self._library, board) as sim:
                for number, value in self._settings.items():
                    sim.command(f"${number}={value}")
                sim.load(self._text, keep_going=True)
                self._run(sim, board.timer_hz)
        except (UserError, MemoryError, OSError):
            return

    def _run(self, sim: Simulation, timer_hz: int) -> None:
        while sim.run(EVENTS_PER_CALL):
            if self._stop.is_set():
                return
            self._mark(sim, timer_hz)
        self._total_s = sim.result().job_ticks / timer_hz

    def _mark(self, sim: Simulation, timer_hz: int) -> None:
        done, _ = sim.progress()
        if done > self._marks_line[-1]:
            self._marks_s.append(sim.result().job_ticks / timer_hz)
            self._marks_line.append(done)
