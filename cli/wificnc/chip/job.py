"""One job through a board's real image in the virtual chip, and beside it through the host's controller."""

from __future__ import annotations

import re
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.model import Board
from wificnc.chip.machine import board_image, wired_chip
from wificnc.chip.pins import SUFFIXES, PinTrace, drive_pins, pin_labels
from wificnc.chip.virtual import CPU_HZ, VirtualChip
from wificnc.errors import JobError, UserError
from wificnc.job.program import CODE_CHARACTERS, MARK, code_of
from wificnc.output import Output, check_suffix
from wificnc.sim.job import read_job, split_lines
from wificnc.sim.run import SimOptions, simulate

IN_FLIGHT = 1000  # bytes on their way to a receive buffer of 1024
SLICE_S = 0.002
BOOT_S = 0.05
PATIENCE_S = 3600.0  # of the chip's time without an answer
STEP = struct.Struct("<QBB6x")
ALARM = re.compile(r"ALARM:\d+(?=\r)")

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
    position_steps: tuple[int, ...]  # where the motors stand
    first_difference: int | None  # step event at which the host's simulation does another; None: all are the same
    same_path: bool  # each axis makes the host's steps in the host's order, whenever that is


def run_on_chip(
    board: Board, options: SimOptions, settings: list[str], progress: Progress | None = None, pace: Pace | None = None
) -> ChipResult:
    """Stream the file at 115200 baud, until the machine rests. options.trace is every edge at the pins, options.at what
    happens to them.

    Raises:
        UserError: a setting or an event is refused, or the trace cannot be written.
        JobError: the file cannot be read, or a line is never answered.
        ChipFault: the image does what no chip may.
    """
    lines = [_wire(line) for line in split_lines(read_job(options.file))]
    pace = pace or Pace()
    with wired_chip(board, board_image(board)) as chip:
        chip.cpu_speed(pace.cpu)
        chip.serial_speed(pace.wire)
        chip.run(BOOT_S)
        chip.read()
        for line in settings:
            (answer,) = _stream(chip, [line], look=lambda: None)
            if answer != "ok":
                raise UserError(f"the controller refuses {line}: {answer}")
        chip.steps()
        drive_pins(chip, board, options.at)
        with _tracing(chip, board, options.trace) as look:
            answers = _stream(chip, lines, look, progress)
            _rest(chip, len(board.axes), look)
        steps = list(STEP.iter_unpack(chip.steps()))
        position = tuple(chip.position(axis) for axis in range(len(board.axes)))
    errors = tuple(f"line {number}: {said}" for number, said in enumerate(answers, 1) if said != "ok")
    seconds = (steps[-1][0] - steps[0][0]) / (CPU_HZ * pace.cpu) if steps else 0.0
    host = _host_steps(options)
    made = [(mask, direction) for _, mask, direction in steps]
    same_path = paths(made, len(position)) == paths(host, len(position))
    return ChipResult(len(answers), errors, seconds, len(steps), position, difference(host, made), same_path)


@contextmanager
def _tracing(chip: VirtualChip, board: Board, path: Path | None) -> Iterator[Look]:
    """Write the pins' edges there while time passes."""
    if path is None:
        yield lambda: None
        return
    check_suffix("--trace", path, SUFFIXES)
    output = Output("--trace", path)
    try:
        with output.staged.open("w", encoding="ascii") as file:
            trace = PinTrace(chip, file, pin_labels(board), path.suffix.lower())
            yield trace.take
            trace.take()
        output.publish()
    finally:
        output.discard()


def _wire(line: bytes) -> str:
    """A line of the file for the wire, as the host's simulation has it (targets/host/sim_text.c): no comment, no mark,
    and what would act as a real-time command is what no controller takes."""
    code = code_of(line)
    if MARK.fullmatch(code):
        return ""
    return "".join(chr(byte) if byte in CODE_CHARACTERS else '"' for byte in code)


def _stream(chip: VirtualChip, lines: list[str], look: Look, progress: Progress | None = None) -> list[str]:
    """By character counting. @return answers"""
    waiting: list[int] = []
    answers: list[str] = []
    said = _answers(chip, look)
    for line in lines:
        while waiting and sum(waiting) + len(line) + 1 > IN_FLIGHT:
            answers.append(next(said))
            waiting.pop(0)
            if progress:
                progress(len(answers), len(lines))
        chip.write(line.encode("latin-1") + b"\n")
        waiting.append(len(line) + 1)
    return answers + [next(said) for _ in waiting]


def _answers(chip: VirtualChip, look: Look) -> Iterator[str]:
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


def _rest(chip: VirtualChip, axes: int, look: Look) -> None:
    """Until nothing has moved for a second. Raises JobError."""
    before: list[int] = []
    said = ""
    while (now := [chip.position(axis) for axis in range(axes)]) != before:
        before = now
        chip.run(1.0)
        look()
        said += chip.read().decode("latin-1")
        if alarm := ALARM.search(said):
            raise JobError(f"{alarm[0]} stopped the job")


def _host_steps(options: SimOptions) -> list[tuple[int, int]]:
    """(axes, directions) of each step event of the host's simulation."""
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "host.csv"
        simulate(SimOptions(options.file, options.board, options.machine, options.settings, trace=trace))
        rows = (line.split(",") for line in trace.read_text().splitlines()[1:])
        return [(int(mask), int(direction)) for _, mask, direction in rows]


def difference(host: list[tuple[int, int]], made: list[tuple[int, int]]) -> int | None:
    """The first event whose axes or directions are not the host's."""
    for event, ((mask, direction), (host_mask, host_direction)) in enumerate(zip(made, host, strict=False)):
        if mask != host_mask or (direction ^ host_direction) & mask:
            return event
    return None if len(made) == len(host) else min(len(made), len(host))


def paths(steps: list[tuple[int, int]], axes: int) -> list[bytes]:
    """The directions of each axis' steps, one after the other."""
    return [bytes(direction >> axis & 1 for mask, direction in steps if mask >> axis & 1) for axis in range(axes)]
