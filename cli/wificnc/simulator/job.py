"""One job through the host controller: a request in, a SimResult out. No console, no files but the trace's."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field
from pathlib import Path

from wificnc.connection.alarms import alarm_words
from wificnc.errors import JobError, UserError
from wificnc.files.bounded import JOB_MAX, read_bytes
from wificnc.job.ending import Ending
from wificnc.job.program import code_of, decoded, printable
from wificnc.job.shown import Written, is_comment, marked
from wificnc.simulator.library import (
    AXES,
    ErrorKind,
    HostBoard,
    NativeError,
    NativeEvent,
    NativeResult,
    Simulation,
    SurveyArc,
    SurveyLine,
)
from wificnc.simulator.look import SAMPLE_MS
from wificnc.simulator.trace import TraceFile

EVENTS_PER_CALL = 500_000  # a few tens of milliseconds of work between two looks at the progress
ROUNDING_MM = 0.05  # a path may leave the programmed one by $11
CHATTER = ("[MSG:Pgm End]", "[MSG:Tool change: ")  # every good program says the first; SimResult lists the changes

CODE = re.compile(rb"(?:^|[\r\n])(?:[^\S\r\n]|\([^)\r\n]*\))*[^\s%;(]")  # neither a comment nor a mark

SPECIAL_BYTE = re.compile(rb"[\x80-\xff!?~]|[(;]\s*(?:MSG|PRINT|DEBUG),", re.IGNORECASE)  # or a comment that is shown

EVENT_HINT = (
    "like: limit x, probe off, door, estop, hold, resume, reset, feed +10, travel x -200 0; see docs/simulation.md"
)

Progress = Callable[[int, int], None]  # lines done, lines in all

NO_SWITCHES = "this simulation has no home switches; --at '0s travel x LOW HIGH' adds them"
NO_NETWORK = "the simulation has no network"
# $ lines that a controller takes and a simulation cannot: what they begin with, and why.
LEFT_OUT = {b"$H": NO_SWITCHES, b"$TAKE": NO_NETWORK, b"$LOGIN": NO_NETWORK}
SWITCHES = ("travel ", "homing ")  # events that make switches


@dataclass(frozen=True)
class Timing:
    """What a board fixes for the simulation."""

    timer_hz: int
    step_pulse_ns: int
    dir_setup_ns: int
    max_step_rate_hz: int
    axis_count: int
    ganged: int = 0  # axes with a second motor, bit 0 = X
    missing_outputs: int = 0  # BOARD_OUTPUT_ bits of core/machine/board.h
    digital_inputs: int = 0  # of M66
    analog: bool = False  # inputs and outputs of M66 .. M68
    motors_wake_us: int = 0  # from powered to the first step
    digital_outputs: int = 0  # of M62 .. M65
    encoder: bool = False  # of the spindle
    home_axes: int = 0  # axes with home switches of their own, bit 0 = X
    tasks: int = 0  # library.Tasks: whose task periods
    default_pulse_us: int = 0  # what $0 starts at; 0: step_pulse_ns
    step_spread_ns: int = 0  # from step to step, beyond the pulse and a pause as long
    step_grid_ns: int = 0  # pulses and pauses are whole ones of it; 0: any
    look_ahead: int = 0  # pieces of path; 0: what the library holds
    laser_marks: int = 0  # changes of a laser's S in it; 0: the same
    toolsetter: bool = False  # a second probe input
    switchless: int = 0  # motors without a switch: bit n = the first one of axis n, bit 6 + n = its second one
    spindle_bus: bool = False  # RS-485 for a spindle drive
    dial: int = 0  # counts a detent, and 8 for one with an axis switch
    driver: tuple[int, ...] = (0,) * 6  # with registers: targets/pc/host_drivers.h


@dataclass(frozen=True)
class At:
    """Something that happens at the machine: words of targets/pc/hands.h, seconds after the job's begin."""

    time_s: float
    action: str


@dataclass(frozen=True)
class SimEvent:
    """What an At found. done is False when the job was over before it; then the rest says nothing."""

    time_s: float
    action: str
    done: bool
    state: str  # right after it, as a status report shows it
    position_steps: tuple[int, ...]
    position_mm: tuple[float, ...]


@dataclass(frozen=True)
class JobRequest:
    """What to run, and on what."""

    file: str
    text: bytes
    timing: Timing
    settings: tuple[str, ...] = ()
    keep_going: bool = False
    lines_max: int | None = None  # of a program with O words
    trace: TraceFile | None = None
    samples: bool = False
    travel_mm: tuple[float | None, ...] = (None,) * len(AXES)
    events: tuple[At, ...] = ()
    survey: bool = False
    commands: tuple[str, ...] = ()  # G-code before the job


@dataclass(frozen=True)
class LineError:
    """One line that was refused."""

    line: int
    code: int
    message: str
    text: str

    @property
    def title(self) -> str:
        """error:22 the feed rate is missing (F)"""
        return f"error:{self.code} {self.message}" if self.code else self.message


@dataclass(frozen=True)
class ToolChange:
    """M6: here the operator changes the tool. The simulation continues immediately."""

    time_s: float
    line: int
    tool: int

    @property
    def title(self) -> str:
        """T2 in line 17"""
        return f"T{self.tool} in line {self.line}"


@dataclass(frozen=True)
class Engraving:
    """What the laser burnt: energy in seconds at full power. Places in machine coordinates."""

    length_mm: float
    constant_mm: float  # of this with M3
    slow_mm: float  # of this with more than `limit` times the energy of the programmed feed
    limit: float
    worst: float  # the most, as a mean of 0.1 mm (targets/sim/engraving.h)
    worst_line: int
    worst_mm: tuple[float, ...]  # X Y Z, where it begins
    pieces: bytes  # records of library.PIECE_DTYPE


@dataclass(frozen=True)
class SimResult:
    """All figures of a run. Per-axis values are in the order of `axes`."""

    file: str
    axes: str
    lines: int
    blocks: int
    segments: int
    step_events: int
    steps_per_axis: tuple[int, ...]
    final_position_steps: tuple[int, ...]
    final_position_mm: tuple[float, ...]
    box_min_mm: tuple[float, ...]
    box_max_mm: tuple[float, ...]
    job_time_s: float
    cutting_time_s: float
    rapid_time_s: float
    max_speed_mm_s: tuple[float, ...]
    max_accel_mm_s2: tuple[float, ...]
    accel_window_s: tuple[float, ...]  # over which it was measured, targets/sim/measure.h
    accel_resolution_mm_s2: tuple[float, ...]  # of which so much is the grain of single steps, at most
    max_step_rate_hz: float
    lookahead_starved: int
    underruns: int
    plan_unmet: int
    errors: tuple[LineError, ...]
    warnings: tuple[str, ...]
    travel_mm: tuple[float | None, ...]
    samples: bytes  # records of library.SAMPLE_DTYPE
    ending: Ending = field(default_factory=Ending)  # what of the file was not run
    engraving: Engraving | None = None  # None: no beam was on
    tool_changes: tuple[ToolChange, ...] = ()
    events: tuple[SimEvent, ...] = ()
    survey_lines: tuple[SurveyLine, ...] = ()  # when the request asks for a survey
    survey_arcs: tuple[SurveyArc, ...] = ()

    @property
    def dwell_time_s(self) -> float:
        return max(0.0, self.job_time_s - self.cutting_time_s - self.rapid_time_s)


def run_job(library: ctypes.CDLL, request: JobRequest, on_progress: Progress | None = None) -> SimResult:
    """Run a job until it ends, or to its first error unless keep_going.

    Raises:
        UserError: a setting or an event is refused.
        JobError: the controller contradicts itself, or there is no room for the trace.
    """
    timing = request.timing
    *numbers, dial, driver = astuple(timing)
    board = HostBoard(*numbers, driver=driver, dial=dial)
    with Simulation(library, board) as sim:
        _apply_lines(sim, (*request.settings, *request.commands))
        _plan_events(sim, request.events)
        if request.trace:
            request.trace.attach(sim)
        if request.survey:
            sim.survey()
        if request.samples:
            sim.sample_every(SAMPLE_MS)
        if request.lines_max is not None:
            sim.limit_lines(request.lines_max)
        text, left_out = simulated_text(request.text, any(at.action.startswith(SWITCHES) for at in request.events))
        text, written = sent_text(text)
        sim.load(text, request.keep_going)
        while sim.run(EVENTS_PER_CALL):
            if on_progress:
                on_progress(*sim.progress())
        if on_progress:
            on_progress(*sim.progress())
        _close(sim, request.trace)
        return _result(sim, request, left_out, written)


def _apply_lines(sim: Simulation, lines: tuple[str, ...]) -> None:
    for line in lines:
        code = sim.command(line)
        if code != 0:
            said = f"error:{code} {sim.status_text(code)}" if code > 0 else "no answer"
            raise UserError(f"the controller refuses {line}: {said}")


def _plan_events(sim: Simulation, events: tuple[At, ...]) -> None:
    for event in events:
        if wrong := sim.at(event.time_s, event.action):
            raise UserError(f"at {event.time_s:g} s, {event.action!r}: {wrong}", hint=EVENT_HINT)


def _close(sim: Simulation, trace: TraceFile | None) -> None:
    try:
        sim.close(trace.raw_path if trace else None)
    except OSError as err:
        assert trace
        raise JobError(f"cannot write the trace {trace.path}: {err.strerror}") from err


def simulated_text(text: bytes, has_switches: bool = False) -> tuple[bytes, tuple[str, ...]]:
    """The job without the $ lines that cannot be simulated, and a remark for each."""
    if b"$" not in text:
        return text, ()
    lines, remarks = split_lines(text), []
    for index, line in enumerate(lines):
        code = code_of(line)
        begin = next((begin for begin in LEFT_OUT if code.startswith(begin)), b"")
        if begin and not (begin == b"$H" and has_switches):
            remarks.append(f"line {index + 1}: {code.decode('ascii', 'replace')} is skipped: {LEFT_OUT[begin]}")
            lines[index] = b""
    return b"\n".join(lines), tuple(remarks)


def _result(sim: Simulation, request: JobRequest, left_out: tuple[str, ...], written: Written) -> SimResult:
    native = _checked(sim.result())
    axes = AXES[: request.timing.axis_count]
    places = (native.position_mm, native.min_mm, native.max_mm)
    positions_mm, min_mm, max_mm = (tuple(values[: len(axes)]) for values in places)
    travel = _travel_warnings(axes, min_mm, max_mm, request.travel_mm)
    return SimResult(
        file=request.file,
        axes=axes,
        lines=native.lines,
        blocks=native.counters.blocks,
        segments=native.counters.segments,
        step_events=native.counters.step_events,
        steps_per_axis=tuple(native.steps_total[: len(axes)]),
        final_position_steps=tuple(native.position_steps[: len(axes)]),
        final_position_mm=positions_mm,
        box_min_mm=min_mm,
        box_max_mm=max_mm,
        job_time_s=native.job_ticks / request.timing.timer_hz,
        cutting_time_s=native.cutting_ticks / request.timing.timer_hz,
        rapid_time_s=native.rapid_ticks / request.timing.timer_hz,
        max_speed_mm_s=tuple(native.max_speed_mm_s[: len(axes)]),
        max_accel_mm_s2=tuple(native.max_accel_mm_s2[: len(axes)]),
        accel_window_s=tuple(native.accel_window_s[: len(axes)]),
        accel_resolution_mm_s2=tuple(_accel_resolution_mm_s2(native, i) for i in range(len(axes))),
        max_step_rate_hz=native.max_step_rate_hz,
        lookahead_starved=native.counters.lookahead_starved,
        underruns=native.counters.underruns,
        plan_unmet=native.counters.plan_unmet,
        errors=_line_errors(sim, request.text),
        warnings=(*left_out, *map(written, _remarks(sim, native)), *travel),
        travel_mm=request.travel_mm,
        samples=sim.samples(),
        ending=native.program_end.ending,
        engraving=_engraving(sim),
        tool_changes=tuple(ToolChange(change.t_s, change.line, change.tool) for change in sim.tool_changes()),
        survey_lines=tuple(sim.survey_lines()),
        survey_arcs=tuple(sim.survey_arcs()),
        events=tuple(_event(event, native, len(axes)) for event in sim.events()),
    )


def _engraving(sim: Simulation) -> Engraving | None:
    pieces, native = sim.engraving_pieces(), sim.engraving()
    if not pieces:
        return None
    return Engraving(
        native.length_mm,
        native.constant_mm,
        native.slow_mm,
        native.limit,
        native.worst,
        native.worst_line,
        tuple(native.worst_mm),
        pieces,
    )


def _accel_resolution_mm_s2(native: NativeResult, axis: int) -> float:
    """Two steps in the window: what of the measured acceleration may be the grain of single steps."""
    return float(2 / (native.steps_per_mm[axis] * native.accel_window_s[axis] ** 2))


def _event(event: NativeEvent, native: NativeResult, axes: int) -> SimEvent:
    steps = tuple(event.position_steps[:axes])
    mm = tuple(count / native.steps_per_mm[i] for i, count in enumerate(steps))
    return SimEvent(event.t_s, event.line.decode(), bool(event.done), event.state.decode(), steps, mm)


def _checked(native: NativeResult) -> NativeResult:
    """The law above all others: the counters are the pulses on the pins."""
    if list(native.position_steps) != list(native.measured_steps):
        raise JobError(
            f"the controller counts {list(native.position_steps)} steps, its pins show {list(native.measured_steps)}",
            hint="this is a bug of WiFiCNC; please report it with the job",
        )
    return native


def _line_errors(sim: Simulation, text: bytes) -> tuple[LineError, ...]:
    found = sim.errors()
    lines = split_lines(text) if found else []
    return tuple(_line_error(sim, error, lines) for error in found)


def _line_error(sim: Simulation, error: NativeError, lines: list[bytes]) -> LineError:
    message = {
        ErrorKind.ERROR: sim.status_text(error.code),
        ErrorKind.ALARM: f"ALARM:{error.code} stopped the job: {alarm_words(error.code)}",
        ErrorKind.NO_ANSWER: "the controller never answered this line",
        ErrorKind.SURPLUS: "the controller sent an extra answer after this line",
        ErrorKind.HELD: "the job is held here, and no event resumes it",
        ErrorKind.RESET: "a reset ended the job here",
    }[ErrorKind(error.kind)]
    text = lines[error.line - 1] if 0 < error.line <= len(lines) else b""
    code = error.code if error.kind == ErrorKind.ERROR else 0
    return LineError(error.line, code, message, printable(text))


def split_lines(text: bytes) -> list[bytes]:
    """Lines as the controller counts them: LF, CR and CR LF end one, and nothing else does."""
    return text.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


def sent_text(text: bytes) -> tuple[bytes, Written]:
    """The job with comments that a controller takes, and what turns its messages back into the file's words."""
    if not SPECIAL_BYTE.search(text):
        return text, str
    lines = split_lines(text)
    found, written = marked(map(decoded, lines))
    # Bytes that are not of a comment stay: the controller refuses them.
    sent = [new.encode("ascii") if new.isascii() else old for new, old in zip(found, lines, strict=True)]
    return b"\n".join(sent), written


def _remarks(sim: Simulation, native: NativeResult) -> list[str]:
    found = [message[5:-1] for message in sim.messages() if not message.startswith(CHATTER)]
    if words := native.program_end.ending.words:
        found.append(words)
    if native.percent_lines:
        found.append(f"{_count(native.percent_lines, 'line')} with % skipped: they are for the sender")
    if native.pauses:
        found.append(f"{_count(native.pauses, 'program pause')} (M0) resumed immediately")
    late = [event for event in sim.events() if not event.done]
    found += [f"the job ended before {event.t_s:g} s: {event.line.decode()}" for event in late]
    return [each for index, each in enumerate(found) if is_comment(each) or each not in found[:index]]


def _travel_warnings(
    axes: str, min_mm: Sequence[float], max_mm: Sequence[float], travel_mm: Sequence[float | None]
) -> Iterator[str]:
    """Where the work zero lies is not known, so only the extent can be too large, and by more than rounding."""
    for axis, low, high, travel in zip(axes, min_mm, max_mm, travel_mm, strict=False):
        if travel is not None and high - low > travel + ROUNDING_MM:
            unit = "mm" if axis in "XYZ" else "deg"
            yield f"{axis} moves over {high - low:.3f} {unit}; this machine's travel is {travel:g} {unit}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def read_job(path: Path) -> bytes:
    """The bytes of a G-code file.

    Raises:
        JobError: it is missing, empty, not readable, or no text in a code the controller knows.
    """
    try:
        text = read_bytes(path, JOB_MAX)
    except FileNotFoundError as err:
        raise JobError(f"file not found: {path}") from err
    except IsADirectoryError as err:
        raise JobError(f"{path} is a folder, not a G-code file") from err
    except OSError as err:
        raise JobError(f"cannot read {path}: {err.strerror}") from err
    if text.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise JobError(f"{path} is written in UTF-16", hint="save it as plain text (UTF-8 or ASCII)")
    text = text.strip(b"\0\x1a")  # the leader of a tape, and the end of a file under CP/M
    if not text.strip():
        raise JobError(f"{path} is empty")
    if b"\0" in text:
        hint = "give the G-code file, not the project of a CAM program"
        raise JobError(f"{path} is not a text file: it has bytes 0x00", hint=hint)
    if not CODE.search(text.removeprefix(b"\xef\xbb\xbf")):
        raise JobError(f"{path} has no G-code", hint="it has only comments and lines with %")
    return text
