"""One job through a board's real image in the virtual chip, and next to it through the host's controller."""

from __future__ import annotations

import csv
import re
import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.model import Board
from wificnc.build.host import ensure_host_library
from wificnc.errors import JobError, UserError
from wificnc.job.ending import MARK
from wificnc.job.expand import Start, expand, load_expand, needs_expansion
from wificnc.job.program import CODE_CHARACTERS, code_of, read_program
from wificnc.output import Output, check_suffix
from wificnc.simulator.job import read_job, simulated_text, split_lines
from wificnc.simulator.run import SimOptions, simulate
from wificnc.simulator.trace import raw_to_npz

from wificnc_chips.pic32mz.chip import VirtualChip
from wificnc_chips.pins import SUFFIXES, PinTrace, drive_pins, pin_labels
from wificnc_chips.wired import Wired, greet, wire

IN_FLIGHT = 1000  # bytes on their way to a receive buffer of 2048
SLICE_S = 0.002
PATIENCE_S = 3600.0  # of the chip's time without an answer
STEP = struct.Struct("<QBB6x")
EVENT = STEP  # a record of a raw trace: time in ns; duty is not measured
ALARM = re.compile(r"ALARM:\d+(?=\r)")
STILL_S = 1.0  # without a step: at rest
SETTING = re.compile(r"\$(\d+)=(\d+(?:\.\d+)?)")
STEP_PULSE_US, STEP_INVERT, DIRECTION_INVERT, SECOND_INVERT = 0, 2, 3, 8  # $0 $2 $3 $8

Progress = Callable[[int, int], None]
Look = Callable[[], None]  # called as time passes


@dataclass(frozen=True)
class Pace:
    """How many times as fast as the chip's the serial port and the CPU are: to see what of a trace is theirs."""

    wire: int = 1
    cpu: int = 1


@dataclass(frozen=True)
class ChipResult:
    """What the image made of a job."""

    lines: int
    errors: tuple[str, ...]  # "line 12: error:20"
    seconds: float  # from the first step to the last one
    events: int
    position_steps: tuple[int, ...]  # of the axes, as the controller counts: $3 does not change the sign
    first_difference: int | None  # step event at which the host's simulation does another; None: all are the same
    same_path: bool  # each axis makes the host's steps in the host's order, whenever that is
    spread_us: float | None = None  # of the events' delays behind the host's; None: other events


def run_on_chip(
    board: Board,
    options: SimOptions,
    settings: list[str],
    progress: Progress | None = None,
    pace: Pace | None = None,
    image: Path | None = None,
) -> ChipResult:
    """Stream the file at 115200 baud, until the machine rests. options.trace is every edge at the pins, options.at what
    happens to them, image what runs: wire().

    Raises:
        UserError: a setting or an event is refused, or the trace cannot be written.
        JobError: the file cannot be read, or a line is never answered.
        ChipFault: the image does what no chip may.
    """
    lines, numbers = _lines(options.file)
    with closing(wire(board, image)) as chip:
        if pace is not None and isinstance(chip, VirtualChip):
            chip.cpu_speed(pace.cpu)
            chip.serial_speed(pace.wire)
        greet(chip)
        steps = _Steps(chip, axes_of_motors(board), board.timing.step_pulse_ns)
        for line in settings:
            (answer,) = _stream(steps, [line], look=lambda: None)
            if answer != "ok":
                raise UserError(f"the controller refuses {line}: {answer}")
        drive_pins(chip, board, options.at)
        with _tracing(steps, board, options.trace) as look:
            answers = _stream(steps, lines, look, progress)
            _rest(chip, len(board.axes), look)
            steps.take()
    errors = tuple(f"line {number}: {said}" for number, said in zip(numbers, answers, strict=True) if said != "ok")
    return _compared(options, board, steps, errors, len(answers))


def _lines(file: Path) -> tuple[list[str], Sequence[int]]:
    """What goes over the wire, as `wificnc send` makes it, and which line of the file each is. Raises JobError."""
    text = read_job(file)
    program = read_program(file.name, text)  # refuses what `wificnc send` refuses
    library = load_expand(ensure_host_library()) if program.may_jump else None
    if library is None or not needs_expansion(library, text):
        lines = [_wire(line) for line in split_lines(simulated_text(text)[0])[: program.ending.line or None]]
        return lines, range(1, len(lines) + 1)
    expanded = expand(library, file.name, text, Start.AT_ZERO)
    return [_wire(line) for line in expanded.text.splitlines()], expanded.numbers


def _compared(options: SimOptions, board: Board, steps: _Steps, errors: tuple[str, ...], lines: int) -> ChipResult:
    """With the host's simulation of the same job."""
    cycles, hz = steps.cycles, steps.chip.cpu_hz
    host, host_ns = _host_steps(options)
    made = as_axes(steps.made, steps.axis)
    way = paths(made, len(board.axes))
    first = difference(host, made)
    return ChipResult(
        lines=lines,
        errors=errors,
        seconds=(cycles[-1] - cycles[0]) / hz if cycles else 0.0,
        events=len(made),
        position_steps=tuple(len(axis) - 2 * sum(axis) for axis in way),
        first_difference=first,
        same_path=way == paths(host, len(board.axes)),
        spread_us=_spread_us(cycles, hz, host_ns) if first is None and cycles else None,
    )


def _spread_us(cycles: list[int], hz: int, host_ns: list[int]) -> float:
    """By how much the events' delays behind the host's differ: 0 is the host's motion, later by a constant."""
    delays = [1e6 * cycle / hz - 1e-3 * ns for cycle, ns in zip(cycles, host_ns, strict=True)]
    return max(delays) - min(delays)


class _Steps:
    """The chip's step events as the controller means them: `$2`, `$3` and `$8` turn levels of wires, and no way.

    A motor steps at the rising edge. With `$2` that is the end of the pulse, so an event of inverted and other axes
    comes as two, a pulse apart; the next event is at least two pulses away.
    """

    def __init__(self, chip: Wired, axis: tuple[int, ...], pulse_ns: int) -> None:
        self.chip = chip
        self.axis = axis  # of each motor
        self.made: list[tuple[int, int]] = []  # motors, directions
        self.cycles: list[int] = []
        self._pulse_s = 1e-9 * pulse_ns
        self._late = 0  # motors that step at the end of the pulse
        self._turned = {DIRECTION_INVERT: 0, SECOND_INVERT: 0}
        self._inverted = 0

    def take(self) -> None:
        """Those since the last call."""
        pulse = 1.5 * self._pulse_s * self.chip.cpu_hz
        for cycle, mask, direction in STEP.iter_unpack(self.chip.steps()):
            direction = (direction ^ self._inverted) & mask
            second = self.made and not mask & ~self._late and not self.made[-1][0] & self._late
            if second and cycle - self.cycles[-1] < pulse:
                self.made[-1] = (self.made[-1][0] | mask, self.made[-1][1] | direction)
                continue
            self.made.append((mask, direction))
            self.cycles.append(cycle)

    def set_up(self, line: str) -> None:
        """A setting is in force; an edge that `$2` makes at rest is not a step."""
        found = SETTING.fullmatch(line)
        if found is None:
            return
        self.chip.steps()
        number, value = int(found[1]), float(found[2])
        if number == STEP_PULSE_US:
            self._pulse_s = 1e-6 * value
        elif number == STEP_INVERT:
            self._late = self._motors(int(value), int(value))
        elif number in self._turned:
            self._turned[number] = int(value)
            first, second = self._turned.values()
            self._inverted = self._motors(first, first ^ second)

    def _motors(self, first: int, second: int) -> int:
        """The first motors of these axes, and the second ones of those."""
        masks = [first if motor == axis else second for motor, axis in enumerate(self.axis)]
        return sum(1 << motor for motor, axis in enumerate(self.axis) if masks[motor] >> axis & 1)


@contextmanager
def _tracing(steps: _Steps, board: Board, path: Path | None) -> Iterator[Look]:
    """Write there while time passes: edges of pins, or as .npz the step events, as `wificnc sim` writes its own."""
    if path is None:
        yield lambda: None
        return
    check_suffix("--trace", path, (*SUFFIXES, ".npz"))
    output = Output("--trace", path)
    try:
        if path.suffix.lower() == ".npz":
            yield lambda: None
            _write_events(steps, output.staged)
        else:
            with output.staged.open("w", encoding="ascii") as file:
                trace = PinTrace(steps.chip, file, pin_labels(board), path.suffix.lower())
                yield trace.take
                trace.take()
        output.publish()
    finally:
        output.discard()


def _write_events(steps: _Steps, staged: Path) -> None:
    raw = staged.with_name(f"{staged.name}.raw")
    zero, hz = steps.cycles[0] if steps.cycles else 0, steps.chip.cpu_hz
    events = zip(steps.cycles, as_axes(steps.made, steps.axis), strict=True)
    try:
        raw.write_bytes(b"".join(EVENT.pack((cycle - zero) * 1_000_000_000 // hz, *made) for cycle, made in events))
        raw_to_npz(raw, staged)
    finally:
        raw.unlink(missing_ok=True)


def _wire(line: bytes) -> str:
    """A line of the file for the wire, as the host's simulation has it (targets/sim/sim_text.c): no comment, no mark,
    and what would act as a real-time command is what no controller takes."""
    code = code_of(line)
    if MARK.fullmatch(code):
        return ""
    return "".join(chr(byte) if byte in CODE_CHARACTERS else '"' for byte in code)


def _stream(steps: _Steps, lines: list[str], look: Look, progress: Progress | None = None) -> list[str]:
    """By character counting; a $ line alone, when the axes are at rest. @return answers"""
    waiting: list[int] = []
    answers: list[str] = []
    said = _answers(steps.chip, look)
    may_move = False
    for line in lines:
        alone = line.startswith("$")
        while waiting and (alone or sum(waiting) + len(line) + 1 > IN_FLIGHT):
            answers.append(next(said))
            waiting.pop(0)
            if progress:
                progress(len(answers), len(lines))
        if alone:
            if may_move:
                _stand(steps, look)
            steps.take()
        steps.chip.write(line.encode("latin-1") + b"\n")
        may_move = not SETTING.fullmatch(line)
        waiting.append(len(line) + 1)
        if alone:
            waiting.clear()
            answers.append(next(said))
            if answers[-1] == "ok":
                steps.set_up(line)
    return answers + [next(said) for _ in waiting]


def _stand(steps: _Steps, look: Look) -> None:
    """Until no motor has moved for a while. Lines that come meanwhile are left to be read."""
    before: list[int] = []
    while (now := [steps.chip.position(motor) for motor in range(len(steps.axis))]) != before:
        before = now
        steps.chip.run(STILL_S)
        look()


def _answers(chip: Wired, look: Look) -> Iterator[str]:
    """Each ok and error, as they come. A pause of the program (M0) is resumed. Raises JobError."""
    rest, quiet_s = "", 0.0
    while quiet_s < PATIENCE_S:
        chip.run(SLICE_S)
        look()
        quiet_s += SLICE_S
        *lines, rest = (rest + chip.read().decode("latin-1")).split("\r\n")
        for line in lines:
            if line == "ok" or line.startswith("error:"):
                quiet_s = 0.0
                yield line
            elif line.startswith("ALARM:"):
                raise JobError(f"{line} stopped the job")
        if quiet_s % 1.0 < SLICE_S:
            chip.write(b"~")
    raise JobError("the image has not answered a line for an hour")


def _rest(chip: Wired, axes: int, look: Look) -> None:
    """Until nothing has moved for a second. Raises JobError."""
    before: list[int] = []
    said = ""
    while (now := [chip.position(axis) for axis in range(axes)]) != before:
        before = now
        chip.run(STILL_S)
        look()
        said += chip.read().decode("latin-1")
        if alarm := ALARM.search(said):
            raise JobError(f"{alarm[0]} stopped the job")


def _host_steps(options: SimOptions) -> tuple[list[tuple[int, int]], list[int]]:
    """(axes, directions) of each step event of the host's simulation, and when it is, ns."""
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "host.csv"
        simulate(SimOptions(options.file, options.board, options.machine, options.settings, trace=trace))
        rows = list(csv.DictReader(trace.read_text(encoding="utf-8").splitlines()))
        return [(int(row["step_mask"]), int(row["dir_mask"])) for row in rows], [int(row["t_ns"]) for row in rows]


def axes_of_motors(board: Board) -> tuple[int, ...]:
    """The number of each motor's axis: the first ones of the axes, then the second ones."""
    return tuple(board.axes.index(name[0].upper()) for name in board.axis.motors())


def as_axes(steps: list[tuple[int, int]], axis: tuple[int, ...]) -> list[tuple[int, int]]:
    """Events of motors as those of axes. A second motor that does not do as the first one stays as it is, and so
    is a difference from the host."""
    for motor, first in enumerate(axis):
        if motor == first:
            continue
        both = 1 << motor | 1 << first
        steps = [
            (mask & ~(1 << motor) if mask & both == both and direction & both in (0, both) else mask, direction)
            for mask, direction in steps
        ]
    return steps


def difference(host: list[tuple[int, int]], made: list[tuple[int, int]]) -> int | None:
    """The first event whose axes or directions are not the host's."""
    for event, ((mask, direction), (host_mask, host_direction)) in enumerate(zip(made, host, strict=False)):
        if mask != host_mask or (direction ^ host_direction) & mask:
            return event
    return None if len(made) == len(host) else min(len(made), len(host))


def paths(steps: list[tuple[int, int]], axes: int) -> list[bytes]:
    """The directions of each axis' steps, one after the other."""
    return [bytes(direction >> axis & 1 for mask, direction in steps if mask >> axis & 1) for axis in range(axes)]
