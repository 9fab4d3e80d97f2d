"""The PIC32MZ's real image in the virtual chip, with the methods of grbl_host.Grbl, so that one test serves both.

What it tells apart from the host's controller, for the tests to be the same:

- Its fourth axis, A, must be at 0 and is left out of what was answered, its settings too. So is the start id in
  reports, which is another one at each start (tests/pic32mz/test_pic32mz_talk.py).
- The wire takes time. It is 16 times as fast as 115200 baud, 5 us a byte, so that a test's moments are its own.
- An output is what the pins show: there are a PWM for the spindle and a flood line, no direction, no mist, no servo.
- A switch is off when it has been quiet for 5 ms; letting one go takes 10 ms here.
- Inputs that the board has no pin for raise NotOnThisBoard. So does what only a simulation of time can tell.

Which tests do not hold here is listed in chip_differences.toml, each with its reason.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
from c_library import EVENT
from grbl_host import HZ
from numpy.typing import NDArray
from step_accelerations import accelerations
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import STEP_DTYPE, motor_wire, pin_number, wired_chip

AXES = 3  # that the tests know of
SERIAL_FACTOR = 16
IN_FLIGHT = 1000  # bytes of lines without an answer
SLICE_S, SHORT_S = 0.001, 0.0001
QUIET_S = 0.06  # without a byte or a step: nothing more comes of lines that have their answers
LONG_S = 5.5  # ... of anything else: a door's restoring takes 5 s
NOTICED_S = 2e-6  # an edge at a pin and its interrupt
DEBOUNCED_S = 0.01
LOOK_S = 0.0013  # the main loop looks every ms: a byte's answer has begun
STUCK = -(1 << 31)  # a switch at this step is always on
PATIENCE_S = 3600.0

PLAN_BURST = 3  # core/motion/planner.h
RX_SIZE, RPM_MAX = 2048, 1000
NUMBERS = r"-?[\d.]+,-?[\d.]+,-?[\d.]+"
FOURTH = re.compile(rf"((?:[MW]Pos|WCO|\[G\d\d(?:\.\d)?|\[PRB):{NUMBERS}),(-?[\d.]+)")
START_ID = re.compile(r"\|Start:[0-9A-F]{8}")
FOURTH_SETTING = re.compile(r"\$1[0-3]3=[\d.]+\r\n")
OC8RS, PR6 = 0xBF844E20, 0xBF840A20


class NotOnThisBoard(Exception):
    """There is no such thing to drive or to look at."""


class ChipGrbl:
    """A controller fresh from its power-on. Time advances only in the methods that say so."""

    def __init__(self, board: Board, image: tuple[Block, ...]) -> None:
        self.board = board
        self._motors = range(len(board.axes))
        self._pins = board.pin_names()
        self._active_high = {use.signal for use in board.uses() if getattr(use.wire, "active", "low") == "high"}
        self._typed = {"30": 1000.0, **{f"10{axis}": 250.0 for axis in range(AXES)}}  # settings, for position() and rpm
        self._waited = 0  # cycles in which send() only made sure that nothing comes
        self._recorded: list[bytes] = []
        self._travel: dict[int, tuple[int, int]] = {}
        self.chip = wired_chip(board, image)
        self.chip.serial_speed(SERIAL_FACTOR)
        for number in range(len(board.input.misc)):
            self.chip.drive(self._pin(f"misc_in_{number}"), 0)

    def close(self) -> None:
        self.chip.close()

    # --- the stream ---

    def put(self, data: str) -> None:
        """Bytes on their way."""
        self._typed.update((number, float(value)) for number, value in re.findall(r"\$(\d+)=([\d.]+)\n", data))
        self.chip.write(data.encode("latin-1"))

    flood = put

    def heard(self) -> str:
        """Log since the last time, up to its last byte."""
        said, quiet_s = self._take(), 0.0
        while quiet_s < self.look_s:
            self.chip.run(SHORT_S)
            more = self._take()
            said, quiet_s = said + more, 0.0 if more or self.chip.unread else quiet_s + SHORT_S
        return self._plain(said)

    def send(self, data: str) -> str:
        """Write as its answers leave room, continue until nothing happens any more, hear."""
        pieces = re.findall(r"[^\n\r]*[\r\n]+|[^\n\r]+$", data)
        lines = len(re.findall(r"\r\n|\r|\n", data))
        said, flying, typed = "", 0, dict(self._typed)
        for piece in pieces:
            while flying > IN_FLIGHT:
                fresh = self._slice()
                said, flying = said + fresh, flying - 10 * answers(fresh)
            self.put(piece)
            flying += max(10, len(piece))
        said += self._settle(lines - answers(said), brief=bool(lines) and not re.search("[\x18~]", data))
        if lines == 1 and "error:" in said:  # a setting that was refused
            self._typed = typed
        return self._plain(said)

    def _settle(self, due: int, brief: bool) -> str:
        """Until nothing comes any more. @param brief  when all answers are there nothing else will come"""
        said, quiet_s, began = "", 0.0, self.chip.cycles
        place = self._raw_stands()
        while quiet_s < (QUIET_S if brief and answers(said) >= due and "ALARM" not in said else LONG_S):
            before, fresh = place, self._slice()
            place = self._raw_stands()
            busy = fresh or self.chip.unread or place != before
            said, quiet_s = said + fresh, 0.0 if busy else quiet_s + SLICE_S
            assert self.chip.cycles - began < PATIENCE_S * self.chip.cpu_hz
        self._waited += round(quiet_s * self.chip.cpu_hz)
        return said

    def fine(self, *lines: str) -> None:
        """Lines that must all be answered ok and nothing else."""
        for line in lines:
            assert self.send(line + "\n").replace("ok\r\n", "", 1) == "", line

    def settings(self, **values: float) -> None:
        lines = "".join(f"${name[1:]}={value}\n" for name, value in values.items())
        assert self.send(lines) == "ok\r\n" * len(values), lines

    def after(self, seconds: float, data: str = "") -> str:
        """Write, let this much time pass, hear."""
        end = self.chip.cycles + round(seconds * self.chip.cpu_hz)
        self.put(data)
        while self.chip.unread:
            self.chip.run(SHORT_S)
        self.chip.run_until(max(end, self.chip.cycles))
        return self.heard()

    paced = after

    def answer_to(self, line: str) -> tuple[str, float]:
        """The answer to a line, and how many seconds that takes: up to the byte, without heard()'s look for more."""
        said, begin = "", self.chip.cycles
        self.put(line + "\n")
        while "\n" not in said:
            self.chip.run(SHORT_S)
            said += self._take()
            assert self.chip.cycles - begin < PATIENCE_S * self.chip.cpu_hz
        return self._plain(said), (self.chip.cycles - begin) / self.chip.cpu_hz

    def sleeps(self) -> bool:
        raise NotOnThisBoard("a chip always ticks")

    def status(self) -> str:
        """The answer to ?, alone."""
        return self.after(0, "?")

    def state(self) -> str:
        """Of lines that were put before, too: once they are read and the main loop has looked."""
        if self.chip.unread:
            while self.chip.unread:
                self.chip.run(SHORT_S)
            self.chip.run(LOOK_S)
        return self.status()[1:].split("|")[0]

    def time(self) -> float:
        return (self.chip.cycles - self._waited) / self.chip.cpu_hz

    def position(self) -> list[int]:
        """Steps, as the controller reports them. Where it is silent (after alarm 1, 2 and 50) and where a step is less
        than a report's 0.001 mm, by the places of the motors; that must be what is reported."""
        found, stands = re.search(rf"MPos:({NUMBERS})", self.status()), self.stands()
        if found is None:
            return stands
        place = [0] * 6
        for axis, mm in enumerate(found[1].split(",")):
            per_mm = self._typed[f"10{axis}"]
            place[axis] = round(float(mm) * per_mm)
            if per_mm > 1000:
                assert abs(stands[axis] - place[axis]) <= per_mm * 0.0005 + 1
                place[axis] = stands[axis]
        return place

    def record(self) -> None:
        """Keep all step edges from now on, for accelerations()."""
        self.chip.steps()
        self._recorded.clear()

    def _steps(self) -> NDArray[np.void]:
        self._recorded.append(self.chip.steps())
        return np.frombuffer(b"".join(self._recorded), dtype=np.dtype(STEP_DTYPE))

    def step_events(self) -> NDArray[np.void]:
        """All step edges since record(), as the host's controller has them."""
        steps = self._steps()
        events = np.zeros(len(steps), EVENT)
        events["t"] = np.rint(steps["cycle"] * (HZ / self.chip.cpu_hz))
        events["step"], events["dir"] = steps["step"], steps["dir"]
        return events

    def first_step_s(self) -> float:
        return float(self._steps()["cycle"][0]) / self.chip.cpu_hz

    def accelerations(self, window_s: float = 0.01) -> NDArray[np.float64]:
        """Steps/s^2 per axis by box differences of the recorded positions."""
        steps = self._steps()
        return accelerations(steps["cycle"] / self.chip.cpu_hz, steps["step"], steps["dir"], window_s)

    def stall(self, side: object, after_s: float, for_s: float) -> None:
        raise NotOnThisBoard("the image's main loop cannot be kept from working by itself")

    def lose_sender(self, waits: bool = False) -> None:
        raise NotOnThisBoard("a UART has no connection that could end")

    def notice(self) -> str | None:
        raise NotOnThisBoard("there is no second client")

    # --- the machine behind it ---

    @property
    def plan_moves(self) -> int:
        """That the planner takes while nothing moves."""
        return self.board.look_ahead - PLAN_BURST

    look_s = LOOK_S
    receive_room = RX_SIZE  # bytes that wait before one is lost
    rpm_step = RPM_MAX / 10_000  # of S, that an output shows with $30=1000
    edge_gap_s = 2e-6  # two edges of a line that are nearer may be one interrupt
    input_delay_s = 0.005 + LOOK_S  # an input of M66 counts when it has been quiet for 5 ms

    @property
    def inputs(self) -> list[str]:
        """Names for input(), of one of each kind that this board has."""
        return ["estop", "limit-x", "probe"]

    def input(self, name: str, active: bool) -> None:
        """By hand; time passes until it has been noticed."""
        if found := re.fullmatch(r"limit-max-([xyz])", name):
            axis = "xyz".index(found[1])
            if axis in self._travel:
                low, high = self._travel[axis]
                self.chip.set_axis(axis, motor_wire(self.board, axis, low, STUCK if active else high))
                return
        pin, level = self._line(name, active)
        self.chip.drive(pin, level)
        self.chip.run(NOTICED_S if active and not name.startswith("input") else DEBOUNCED_S)

    def input_in(self, seconds: float, name: str, active: bool) -> None:
        pin, level = self._line(name, active)
        self.chip.drive_at(self.chip.cycles + round(seconds * self.chip.cpu_hz), pin, level)

    def analog(self, number: int, percent: float) -> None:
        raise NotOnThisBoard(f"analog input {number}")

    def travel(self, axis: int, low: int, high: int) -> None:
        self._travel[axis] = (low, high)
        self.chip.set_axis(axis, motor_wire(self.board, axis, low, high))

    def surface(self, steps: int) -> None:
        self.chip.surface(self._pin("probe"), steps)

    def toolsetter(self, x: int, y: int, z: int, radius: int = 1250) -> None:
        self.chip.toolsetter(self._pin("toolsetter"), (x, y, z), radius)

    def place(self, steps: Sequence[int]) -> None:
        for axis, position in enumerate(steps[:AXES]):
            self.chip.place(axis, position)

    def stands(self) -> list[int]:
        """Steps, as the motors really stand."""
        x, y, z, a = self._raw_stands()
        assert a == 0
        return [x, y, z, 0, 0, 0]

    def spindle_encoder(self, counts: int) -> None:
        raise NotOnThisBoard("an encoder")

    def outputs(self) -> SimpleNamespace:
        """What the pins show; fields of struct virtual_outputs."""
        duty = self.chip.read_register(OC8RS) / (self.chip.read_register(PR6) + 1)
        enable = self.chip.level(self._pin("enable_x"))
        return SimpleNamespace(
            spindle_direction=int(duty > 0),
            spindle_rpm=self._typed["30"] * duty,
            spindle_duty=round(duty * 65535),
            coolant=2 * self.chip.level(self._pin("coolant_flood")),
            motors=bool(self.chip.level(self._pin("led"))),
            enable_high=bool(enable),
            digital=self.chip.level(self._pin("misc_out_0")),
        )

    def laser_s(self) -> float:
        """S that a laser's output shows, with $30=1000 and $31=0; in tenths."""
        return round(self.outputs().spindle_duty / 65535 * 1000, 1)

    # --- inside ---

    def _pin(self, signal: str) -> int:
        if signal not in self._pins:
            raise NotOnThisBoard(signal)
        return pin_number(self._pins[signal])

    def _line(self, name: str, active: bool) -> tuple[int, int]:
        """A host's input by name (targets/pc/virtual.h): its pin and level here."""
        if found := re.fullmatch(r"limit(?:-(min|max))?-(\w)", name):
            signal = f"limit_{found[2]}_{found[1] or 'min'}"
        elif found := re.fullmatch(r"input-(\d)", name):
            return self._pin(f"misc_in_{found[1]}"), int(active)
        else:
            signal = name
        return self._pin(signal), int(active == (signal in self._active_high))

    def _raw_stands(self) -> list[int]:
        return [self.chip.position(axis) for axis in self._motors]

    def _plain(self, said: str) -> str:
        """As tests of three axes know it."""
        return as_three_axes(START_ID.sub("", said))

    def _take(self) -> str:
        return self.chip.read().decode("latin-1")

    def _slice(self) -> str:
        self.chip.run(SLICE_S)
        return self._take()


def answers(said: str) -> int:
    return len(re.findall(r"(?:^|\n)(?:ok|error:\d+)\r", said))


def as_three_axes(said: str) -> str:
    """Without the axis that the host's controller has not. It never moves."""
    for number in (found[2] for found in FOURTH.finditer(said)):
        assert float(number) == 0, said
    return FOURTH_SETTING.sub("", FOURTH.sub(r"\1", said))
