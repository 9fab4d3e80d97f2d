"""A Grbl controller in virtual time with a machine behind it: ctypes on targets/pc/host.h, targets/pc/virtual.h."""

from __future__ import annotations

import ctypes
import random
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import stalls
from c_library import LIB
from layouts import HOST
from monitor import CHECKS, Checks, Monitor
from numpy.typing import NDArray
from step_accelerations import accelerations
from step_log import StepLog
from wificnc.simulator.library import HostBoard, HostCounters, Tasks

AXES = 6
HZ = 20_000_000
TMC5160 = 2  # enum tmc_kind
HOST_IDLE, HOST_ROOM, HOST_BUDGET, HOST_TIME = range(4)
HEARD = ctypes.create_string_buffer(65536)  # of one call
BANNER = "\r\nGrbl 1.1h ['$' for help]\r\n"
LOCKED = "[MSG:'$H'|'$X' to unlock]\r\n"
RX_SIZE = 2048
PLAN_MOVES = 253  # that the planner takes while nothing moves: its pieces of path without PLAN_BURST
Steps = ctypes.c_int32 * AXES
OUTPUT_CHANGE = HOST.record("output_change", t_ticks="t")
Outputs = HOST.struct("virtual_outputs")


PUMP = {"pump_hz": 10_000, "pump_clock_hz": 20_000_000, "pump_ticks_min": 256, "pump_ticks_max": 262_143}


def add_drivers(board: HostBoard, axes: int) -> None:
    """TMC5160 in a chain."""
    for axis in range(axes):
        board.driver[axis] = TMC5160 | axis << 4 | axes << 12


class Grbl:
    """One controller. Time advances only in the methods that say so."""

    def __init__(
        self,
        axes: int = 3,
        store: Path | None = None,
        ganged: int = 0,
        lacks: int = 0,  # BOARD_OUTPUT_ bits of core/machine/board.h
        ports: bool = True,  # four inputs, and analog ones
        motors_wake_us: int = 0,
        encoder: bool = False,
        outputs: int = 5,
        pump: bool = False,
        spindle_bus: bool = False,  # with the drive that $395 names
        home: int = 0,  # axes with home switches of their own
        drivers: bool = False,  # a TMC5160 on each axis, in a chain
        board: HostBoard | None = None,  # this one instead of all that
        tasks: Tasks = Tasks.FREE,
        checks: Checks = CHECKS,
    ) -> None:
        timing = (HZ, 1000, 500, 500_000)
        board = board or HostBoard(
            *timing,
            axes,
            ganged,
            lacks,
            4 * ports,
            ports,
            motors_wake_us,
            outputs,
            encoder,
            home,
            tasks,
            toolsetter=ports,
            spindle_bus=spindle_bus,
            **PUMP if pump else {},
        )
        add_drivers(board, axes * drivers)
        self._host = LIB.host_open(ctypes.byref(board), str(store).encode() if store else None)
        assert self._host
        self.monitor = Monitor(LIB, self._host, checks)
        LIB.host_input_follows(self._host, 0)

    def close(self) -> None:
        try:
            self.monitor.close()
        finally:
            LIB.host_destroy(self._host)

    # --- the stream ---

    def put(self, data: str) -> None:
        """Bytes that must find room; no time passes."""
        raw = data.encode("latin-1")
        assert LIB.host_write(self._host, raw, len(raw)) == len(raw)

    def flood(self, data: str) -> None:
        """Bytes of a sender that does not wait."""
        raw = data.encode("latin-1")
        LIB.host_write_or_lose(self._host, raw, len(raw))

    def heard(self) -> str:
        """Log since the last time."""
        said = b""
        while count := LIB.host_read(self._host, HEARD, len(HEARD)):
            said += HEARD[:count]
        self.monitor.check()
        return said.decode("latin-1")

    def send(self, data: str) -> str:
        """Put, continue until nothing happens any more, hear."""
        raw = data.encode("latin-1")
        said = ""
        while True:
            raw = raw[LIB.host_write(self._host, raw, len(raw)) :]
            LIB.host_input_follows(self._host, 0)
            wait = LIB.host_run(self._host, 50_000_000)
            said += self.heard()
            if wait == HOST_IDLE and not raw:
                return said

    def stream(self, data: str) -> str:
        """As send(), from a sender that is fast enough: the controller always has lines waiting."""
        raw, said = data.encode("latin-1"), ""
        while raw:
            raw = raw[LIB.host_write(self._host, raw, len(raw)) :]
            LIB.host_input_follows(self._host, int(bool(raw)))
            LIB.host_run(self._host, 50_000_000)
            said += self.heard()
        return said + self.send("")

    def stream_for(self, seconds: float, data: str) -> str:
        """As stream(), for this long. @return what was not put"""
        raw, end = data.encode("latin-1"), LIB.host_time_ticks(self._host) + round(seconds * HZ)
        LIB.host_input_follows(self._host, 0)  # or no time passes in a hold
        while LIB.host_time_ticks(self._host) < end:
            raw = raw[LIB.host_write(self._host, raw, len(raw)) :]
            LIB.host_run_until(self._host, min(end, LIB.host_time_ticks(self._host) + HZ // 1000))
        return raw.decode("latin-1")

    def fine(self, *lines: str) -> None:
        """Lines that must all be answered ok and nothing else."""
        for line in lines:
            assert self.send(line + "\n").replace("ok\r\n", "", 1) == "", line

    def settings(self, **values: float) -> None:
        self.fine(*(f"${name[1:]}={value}" for name, value in values.items()))

    def after(self, seconds: float, data: str = "") -> str:
        """Put, let this much time pass, hear."""
        self.put(data)
        LIB.host_input_follows(self._host, 0)
        LIB.host_run_until(self._host, LIB.host_time_ticks(self._host) + round(seconds * HZ))
        return self.heard()

    def answer_to(self, line: str) -> tuple[str, float]:
        """The answer to a line, and how many seconds that takes."""
        begin = self.time()
        said = self.after(0.001, line + "\n")
        while "\n" not in said:
            said += self.after(0.001)
        return said, self.time() - begin

    def paced(self, seconds: float, data: str = "") -> str:
        """As after(), but a first move waits for more of them, as it does in real time."""
        self.put(data)
        LIB.host_run_paced(self._host, LIB.host_time_ticks(self._host) + round(seconds * HZ), 50_000_000)
        return self.heard()

    def sleeps(self) -> bool:
        """Nothing happens until someone says or does something."""
        return LIB.host_next_ticks(self._host) == 2**64 - 1

    def lose_sender(self, waits: bool = False) -> None:
        """The connection of who commands ends. @param waits  lines of it have not come to the controller yet"""
        LIB.host_sender_lost(self._host, waits)

    def notice(self) -> str | None:
        """What the next client reads."""
        text = ctypes.create_string_buffer(128)
        return text.value.decode() if LIB.host_notice(self._host, 0, text, len(text)) else None

    def notices(self) -> list[str]:
        """All that the next client reads."""
        text = ctypes.create_string_buffer(192)
        found = []
        while LIB.host_notice(self._host, len(found), text, len(text)):
            found.append(text.value.decode())
        return found

    def status(self) -> str:
        """The answer to ?, alone; no time passes."""
        return self.after(0, "?")

    def lines(self) -> int:
        """Lines taken so far; step edges name the line that they are of by this count."""
        counters = HostCounters()
        LIB.host_counters(self._host, ctypes.byref(counters))
        return int(counters.lines)

    def state(self) -> str:
        return self.status()[1:].split("|")[0]

    def time(self) -> float:
        return int(LIB.host_time_ticks(self._host)) / HZ

    def position(self) -> list[int]:
        """Steps, as the controller counts them."""
        steps = Steps()
        LIB.host_position_steps(self._host, steps)
        return list(steps)

    def record(self) -> None:
        """Keep all step edges from now on, for accelerations()."""
        self._log = StepLog()
        assert LIB.trace_add(LIB.host_trace(self._host), self._log.consumer, None)

    def step_events(self) -> NDArray[np.void]:
        """All step edges since record()."""
        return self._log.events()

    def output_period(self, microseconds: int) -> None:
        """Spindle and coolant pins follow the controller only this often; 0: immediately."""
        LIB.host_set_output_period(self._host, microseconds)

    def record_outputs(self) -> None:
        """Keep all changes of the spindle and coolant pins from now on."""
        LIB.host_record_outputs(self._host)

    def output_changes(self) -> NDArray[np.void]:
        """What the pins were from which time (ticks) on, since record_outputs()."""
        changes = ctypes.c_void_p()
        count = LIB.host_output_changes(self._host, ctypes.byref(changes))
        return np.frombuffer(ctypes.string_at(changes, count * OUTPUT_CHANGE.itemsize), dtype=OUTPUT_CHANGE)

    def first_step_s(self) -> float:
        """Time of the first step edge since record()."""
        return float(self.step_events()["t"][0]) / HZ

    def accelerations(self, window_s: float = 0.01) -> NDArray[np.float64]:
        """Steps/s^2 per axis by box differences of the recorded positions."""
        events = self.step_events()
        return accelerations(events["t"] / HZ, events["step"], events["dir"], window_s)

    # --- stalls ---

    def stall(self, side: stalls.Side, after_s: float, for_s: float) -> None:
        """Keep a side of the firmware from working; step interrupts and edges of inputs continue."""
        stalls.stall(LIB, self._host, side, after_s, for_s, HZ)

    def stall_randomly(self, seed: int, sides: Collection[stalls.Side] = stalls.SIDES, **how: int) -> None:
        stalls.stall_randomly(LIB, self._host, seed, sides, **how)

    def stall_often(self, rng: random.Random, sides: Sequence[stalls.Side], count: int = 30) -> None:
        stalls.stall_often(LIB, self._host, rng, sides, HZ, count)

    # --- the machine behind it ---

    plan_moves = PLAN_MOVES
    receive_room = RX_SIZE  # bytes that wait before one is lost
    rpm_step = 1e-3  # of S, that an output shows with $30=1000
    edge_gap_s = 0.0  # edges of a line that are nearer are not seen apart
    input_delay_s = 0.0  # from a level to its being noticed

    @property
    def inputs(self) -> list[str]:
        """Names for input(), of one of each kind that this board has."""
        return ["door", "estop", "limit-x", "probe", "hold"]

    def input(self, name: str, active: bool) -> None:
        LIB.virtual_set(self._host, LIB.virtual_input_number(name.encode()), active)

    def input_in(self, seconds: float, name: str, active: bool) -> None:
        number = LIB.virtual_input_number(name.encode())
        assert LIB.virtual_at(self._host, LIB.host_time_ticks(self._host) + round(seconds * HZ), number, active)

    def analog(self, number: int, percent: float) -> None:
        LIB.virtual_analog(self._host, number, percent)

    def travel(self, axis: int, low: int, high: int) -> None:
        LIB.virtual_travel(self._host, axis, low, high)

    def homing(self, axis: int, low: int, high: int) -> None:
        LIB.virtual_home(self._host, axis, low, high)

    def surface(self, steps: int) -> None:
        LIB.virtual_surface(self._host, steps)

    def toolsetter(self, x: int, y: int, z: int, radius: int = 1250) -> None:
        LIB.virtual_toolsetter(self._host, Steps(x, y, z), radius)

    def place(self, steps: Sequence[int]) -> None:
        LIB.virtual_place(self._host, Steps(*steps))

    def stands(self) -> list[int]:
        """Steps, as the machine really is."""
        steps = Steps()
        LIB.virtual_position(self._host, steps)
        return list(steps)

    def skew(self, axis: int, steps: int) -> None:
        LIB.virtual_skew(self._host, axis, steps)

    def second_stands(self) -> list[int]:
        """Steps, as the second motors really stand."""
        steps = Steps()
        LIB.virtual_second_position(self._host, steps)
        return list(steps)

    def spindle_ramp(self, rpm_s: float) -> None:
        LIB.virtual_spindle_ramp(self._host, rpm_s)

    def spindle_load(self, percent: float) -> None:
        LIB.virtual_spindle_load(self._host, percent)

    def spindle_encoder(self, counts: int) -> None:
        LIB.virtual_spindle_encoder(self._host, counts)

    def spindle_angle(self) -> float:
        """Revolutions since power-on, now."""
        return float(LIB.virtual_spindle_angle(self._host, LIB.host_time_ticks(self._host)))

    def spindle_rpm(self) -> float:
        return float(LIB.virtual_spindle_rpm(self._host))

    def laser_s(self) -> float:
        """S that a laser's output shows, with $30=1000 and $31=0; in tenths, finer than a PWM is."""
        return round(self.outputs().spindle_duty / 65535 * 1000, 1)

    def outputs(self) -> Any:
        """struct virtual_outputs: what the pins show."""
        outputs = Outputs()
        LIB.virtual_outputs(self._host, ctypes.byref(outputs))
        return outputs
