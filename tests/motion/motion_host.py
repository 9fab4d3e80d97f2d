"""The host controller for motion tests: programs in, step edges out. Talks to targets/pc/host.h through ctypes."""

from __future__ import annotations

import ctypes
import random
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import stalls
from c_library import LIB
from monitor import CHECKS, Checks, Monitor
from numpy.typing import NDArray
from step_log import StepLog
from wificnc.simulator.library import HostBoard, HostCounters, Tasks

AXES = 6
# The measuring settings: 250 steps/mm, 5000 mm/min, 500 mm/s2.
BASELINE = {f"s{base + ax}": value for base, value in ((100, 250), (110, 5000), (120, 500)) for ax in range(6)}
HOST_IDLE, HOST_ROOM, HOST_BUDGET = range(3)


@dataclass
class Run:
    """What one program did."""

    events: NDArray[np.void]
    said: str
    answers: list[str]
    position: list[int]
    end_ticks: int
    timer_hz: int
    counters: HostCounters = field(repr=False)

    def seconds(self) -> NDArray[np.float64]:
        return self.events["t"] / self.timer_hz

    def positions(self) -> NDArray[np.int64]:
        """Steps of every axis after each event, one row an event."""
        return self._positions

    @cached_property
    def _positions(self) -> NDArray[np.int64]:
        bit = np.arange(AXES, dtype=np.uint8)[:, None]  # an axis' events next to each other: a third of the time
        stepped, back = (np.ascontiguousarray(self.events[name]) >> bit & 1 for name in ("step", "dir"))
        places = np.cumsum(stepped * (1 - 2 * back.astype(np.int8)), axis=1, dtype=np.int64).T
        places.flags.writeable = False
        return places

    def counted(self) -> list[int]:
        """Pulses of every axis, signed, from power-on when this is the first run."""
        return [int(steps) for steps in self.positions()[-1]] if len(self.events) else [0] * AXES


class Host:
    """One controller in virtual time."""

    def __init__(
        self,
        timer_hz: int = 20_000_000,
        pulse_ns: int = 1000,
        setup_ns: int = 500,
        rate_hz: int = 500_000,
        axes: int = 6,
        tasks: Tasks = Tasks.FREE,
        checks: Checks = CHECKS,
    ) -> None:
        self.timer_hz = timer_hz
        board = HostBoard(timer_hz, pulse_ns, setup_ns, rate_hz, axes, tasks=tasks)
        self._host = LIB.host_create(ctypes.byref(board))
        assert self._host
        self.monitor = Monitor(LIB, self._host, checks)
        self.steps = StepLog()
        self._said = b""
        self._started = False
        assert LIB.trace_add(LIB.host_trace(self._host), self.steps.consumer, None)

    def close(self) -> None:
        try:
            self.monitor.close()
        finally:
            LIB.host_destroy(self._host)

    def _hear(self) -> None:
        buffer = ctypes.create_string_buffer(65536)
        while count := LIB.host_read(self._host, buffer, len(buffer)):
            self._said += buffer.raw[:count]
        self.monitor.check()

    def settings(self, **values: float) -> None:
        """`s110=5000` sends $110=5000; every one must be taken."""
        text = "".join(f"${name[1:]}={value}\n" for name, value in values.items())
        answers = self.run(text).answers
        assert answers == ["ok"] * len(values), answers

    def start(self, program: str) -> None:
        """Hand over a short program and let no time pass."""
        self.steps.clear()
        self._said = b""
        LIB.host_input_follows(self._host, 0)
        assert LIB.host_write(self._host, program.encode("latin-1"), len(program)) == len(program)
        self._started = True

    def advance(self, events: int) -> int:
        """Work for this many timer events. @return why it stopped"""
        return int(LIB.host_run(self._host, events))

    def until(self, ticks: int) -> None:
        """Continue to this time."""
        LIB.host_run_until(self._host, ticks)

    def stall_sides(self, sides: int, from_s: float, for_s: float) -> None:
        """The task side (1), the motion side (2) or both (3) do nothing in this time; the step ISR works on."""
        for bit, side in ((1, stalls.Side.CONTROLLER), (2, stalls.Side.MOTION)):
            if sides & bit:
                assert LIB.host_stall(self._host, side, round(from_s * self.timer_hz), round(for_s * self.timer_hz))

    def press(self, name: str, active: bool) -> None:
        """An input of the machine: probe, estop, door ..."""
        LIB.virtual_set(self._host, LIB.virtual_input_number(name.encode()), active)

    def stall(self, side: stalls.Side, after_s: float, for_s: float) -> None:
        """Keep a side of the firmware from working; step interrupts continue."""
        stalls.stall(LIB, self._host, side, after_s, for_s, self.timer_hz)

    def stall_randomly(self, seed: int, sides: Collection[stalls.Side] = stalls.SIDES, **how: int) -> None:
        stalls.stall_randomly(LIB, self._host, seed, sides, **how)

    def stall_often(self, rng: random.Random, sides: Sequence[stalls.Side], count: int = 30) -> None:
        stalls.stall_often(LIB, self._host, rng, sides, self.timer_hz, count)

    def look_each(self, seconds: float) -> None:
        """From now on the controller looks only so often."""
        LIB.host_look_each(self._host, round(seconds * 1e6))

    def counters(self) -> HostCounters:
        counters = HostCounters()
        LIB.host_counters(self._host, ctypes.byref(counters))
        return counters

    def wait(self, seconds: float) -> None:
        """Let this time pass, with no one at the other end of the line."""
        end_ticks = self.ticks() + round(seconds * self.timer_hz)
        while self.ticks() < end_ticks:
            LIB.host_run_paced(self._host, end_ticks, 10_000_000)

    def put(self, text: str) -> None:
        """Real-time bytes, between two advances."""
        assert LIB.host_write(self._host, text.encode("latin-1"), len(text)) == len(text)

    def ticks(self) -> int:
        return int(LIB.host_time_ticks(self._host))

    def settle(self) -> Run:
        """Continue until nothing happens any more. The result holds all since start()."""
        while LIB.host_run(self._host, 10_000_000) != HOST_IDLE:
            pass
        self._hear()
        return self._result()

    def status(self) -> str:
        """The answer to ?, alone."""
        self._hear()
        before = len(self._said)
        self.put("?")
        self.settle()
        return self._said[before:].decode("latin-1")

    def run(self, program: str) -> Run:
        """Stream the program to its end and come to rest. The result holds all since start(), if that was called."""
        data = program.encode("latin-1")
        if not self._started:
            self.steps.clear()
            self._said = b""
        self._started = False
        LIB.host_input_follows(self._host, 1)
        at = 0
        while True:
            at += LIB.host_write(self._host, data[at : at + 4096], len(data[at : at + 4096]))
            if at == len(data):
                LIB.host_input_follows(self._host, 0)
            wait = LIB.host_run(self._host, 10_000_000)
            self._hear()
            if wait == HOST_IDLE and at == len(data):
                return self._result()

    def paced(self, program: str, bytes_per_ms: int) -> Run:
        """The same from a sender that has so many bytes each millisecond."""
        self._send(program, bytes_per_ms)
        return self.settle()

    def paced_like_a_chip(self, program: str, bytes_per_ms: int) -> Run:
        """The same, and the controller finds out itself that nothing follows: no more has come for a while."""
        self._send(program, bytes_per_ms)
        self.wait(0.02)
        while LIB.host_is_busy(self._host):
            self.wait(0.02)
        self._hear()
        return self._result()

    def _send(self, program: str, bytes_per_ms: int) -> None:
        data = program.encode("latin-1")
        self.start("")
        sent = taken = 0
        while taken < len(data):
            sent = min(len(data), sent + bytes_per_ms)
            taken += LIB.host_write(self._host, data[taken:sent], sent - taken)
            self.wait(0.001)
            self._hear()

    def _result(self) -> Run:
        position = (ctypes.c_int32 * AXES)()
        LIB.host_position_steps(self._host, position)
        said = self._said.decode("latin-1")
        answers = [line for line in said.split("\r\n") if line == "ok" or line.startswith("error:")]
        return Run(
            self.steps.events(),
            said,
            answers,
            list(position),
            LIB.host_time_ticks(self._host),
            self.timer_hz,
            self.counters(),
        )
