"""Resume in the middle of a job: what the lines before have set, and the lines that set it again, safely.

The lines before N run through the core's own parser twice, from two different places. What comes out the same does
not depend on where the machine stood when the job began, and is known; an axis that moved and comes out different
cannot be known, and the resume is refused rather than guessed.

How it returns: first Z up to the highest place that the job has used, then the spindle and time for it to run up, then
X, Y and the turning axes, then Z down at a careful feed. The modal words of line N come last.
"""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from wificnc.connection.client import error_words
from wificnc.errors import JobError
from wificnc.job.program import JobLine, Program, words_of
from wificnc.job.rebuild import AXES, ModalState, Rebuild

SPINDLE_WAIT_S = 4.0
PLUNGE_MM_MIN = 200.0
Z = AXES.index("Z")
SAME_MM = 1e-6
CHECK_MM = 1e-4
NEAR_LINES = 2000  # before the line asked for, where one that can be resumed is looked for first
TRIES = 5
# Two places that no program ends at by chance.
SOMEWHERE_MM = (-311.625, 247.375, -211.875, 97.625, -57.875, 33.375)
ELSEWHERE_MM = (137.25, -91.5, 53.125, 31.75, -17.5, 71.25)

MOTION_CODES = {
    0.0,
    1.0,
    2.0,
    3.0,
    5.0,
    5.1,
    33.0,
    33.1,
    38.2,
    38.3,
    38.4,
    38.5,
    73.0,
    76.0,
    *map(float, range(80, 90)),
}
ROWS = {"G5", "G5.1", "G73", "G81", "G82", "G83", "G85", "G86", "G89"}  # words of one line hold for the next
# Of $G: what a job may leave to the controller, but for motion, tool and what is switched on.
MODE = re.compile(r"G5[4-9](\.[123])?|G1[789]|G2[01]|G9[01](\.1)?|G9[345]|[FS][\d.]+")
AXES_FOR_OTHERS = {10.0, 28.0, 28.1, 30.0, 30.1, 43.0, 43.1, 92.0, 92.1}


@dataclass(frozen=True)
class MachineFacts:
    """What the controller says of itself before the resume; mm."""

    axis_count: int
    work_mm: tuple[float, ...]
    machine_mm: tuple[float, ...]
    offsets: dict[str, tuple[float, ...]] = field(default_factory=dict)  # rows of $#; empty = it does not tell
    laser: bool = False
    modes: tuple[str, ...] = ()  # words of $G in which the job's first line runs; empty = those of a reset


@dataclass(frozen=True)
class Approach:
    """How to go back to the work."""

    safe_z_mm: float | None = None  # work coordinates; None = the highest Z of the lines before
    spindle_wait_s: float = SPINDLE_WAIT_S
    plunge_mm_min: float = PLUNGE_MM_MIN


@dataclass(frozen=True)
class Resume:
    """A job from line N on."""

    line: int
    state: ModalState
    preamble: tuple[JobLine, ...]
    rest: tuple[JobLine, ...]
    notes: tuple[str, ...]

    @property
    def lines(self) -> tuple[JobLine, ...]:
        return (*self.preamble, *self.rest)


@dataclass(frozen=True)
class _Known:
    """The state at line N, and which axes' places are known."""

    state: ModalState
    axes: tuple[bool, ...]
    top_work_mm: float | None


@dataclass(frozen=True)
class Restart:
    """Where plan_resume() accepts a line, for someone who asks for another one."""

    line: int | None  # None: nowhere at or before the line asked for
    why_not: str = ""  # the line asked for is refused
    at_begin: bool = False  # nothing has moved before it


def plan_resume(
    library: ctypes.CDLL, program: Program, line: int, facts: MachineFacts, approach: Approach | None = None
) -> Resume:
    """What to send to continue from a line of the file.

    Raises:
        JobError: there is no such line, or what comes before it cannot be rebuilt with certainty.
    """
    before = [job_line for job_line in program.lines if job_line.number < line]
    rest = [job_line for job_line in program.lines if job_line.number >= line]
    if not 1 <= line <= program.file_lines or not rest:
        last = program.lines[-1].number
        why = program.ending.words or f"the last line with code is {last}"
        raise JobError(f"nothing to send from line {line}: {why}", hint=program.ending.hint)
    known = _known_state(library, before, facts)
    preamble = _preamble(known, facts, approach or Approach())
    _check(library, known, preamble, facts)
    rest = _with_motion(known.state, rest)
    return Resume(line, known.state, tuple(_job_line(code) for code in preamble), tuple(rest), _notes(known))


def nearest_resume(
    library: ctypes.CDLL, program: Program, wanted: int, facts: MachineFacts, approach: Approach | None = None
) -> Restart:
    """The last line, at or before the wanted one, that plan_resume() accepts."""
    approach = approach or Approach()
    try:
        plan_resume(library, program, wanted, facts, approach)
    except JobError as err:
        why_not = err.message
    else:
        return Restart(wanted)
    for _, line in zip(range(TRIES), _known_lines(library, program, wanted, facts, approach), strict=False):
        try:
            resume = plan_resume(library, program, line, facts, approach)
        except JobError:
            continue
        return Restart(line, why_not, not any(resume.state.moved))
    return Restart(None, why_not)


def _known_lines(
    library: ctypes.CDLL, program: Program, wanted: int, facts: MachineFacts, approach: Approach
) -> Iterator[int]:
    """Lines before the wanted one at which the state is known, the last one first."""
    lines = [job_line for job_line in program.lines if job_line.number < wanted]
    near = max(0, len(lines) - NEAR_LINES)
    yield from reversed(_known_in(library, lines, near, facts, approach))
    if near:
        yield from reversed(_known_in(library, lines[:near], 0, facts, approach))


def _known_in(
    library: ctypes.CDLL, lines: Sequence[JobLine], first: int, facts: MachineFacts, approach: Approach
) -> list[int]:
    """The numbers among lines[first:] at which the lines before leave nothing unknown."""
    found = []
    with _begun(library, facts, SOMEWHERE_MM) as here, _begun(library, facts, ELSEWHERE_MM, _perturb(facts)) as there:
        for index, job_line in enumerate(lines):
            if index >= first and _is_known(here.state(), there.state(), facts, approach):
                found.append(job_line.number)
            if here.line(job_line.wire[:-1]) or there.line(job_line.wire[:-1]):
                break  # no line after this one can be resumed
    return found


def _is_known(here: ModalState, there: ModalState, facts: MachineFacts, approach: Approach) -> bool:
    try:
        _preamble(_judge(here, there, facts), facts, approach)
    except JobError:
        return False
    return True


def _known_state(library: ctypes.CDLL, before: Sequence[JobLine], facts: MachineFacts) -> _Known:
    here = _run(library, before, facts, SOMEWHERE_MM)
    there = _run(library, before, facts, ELSEWHERE_MM, _perturb(facts))
    return _judge(here, there, facts)


def _perturb(facts: MachineFacts) -> bool:
    """Offsets that the controller does not tell are not known."""
    return not facts.offsets


def modes_of(words: Iterable[str]) -> tuple[str, ...]:
    """What a job that does not say it takes from the controller, of the words of $G."""
    return tuple(word for word in words if MODE.fullmatch(word))


def _judge(here: ModalState, there: ModalState, facts: MachineFacts) -> _Known:
    """What the same lines have set, begun at two places. Raises JobError: it depends on where they began."""
    if here.g92_mm != _row(facts, "G92"):
        raise JobError(
            "the lines before set a G92 offset, which depends on the machine's position at that time",
            hint="set it by hand and cut the file there, or use G10 L2 / G54 in the program",
        )
    if here.motion in ROWS:
        raise JobError(
            f"the lines before are in a sequence of canned cycles or splines ({here.motion})",
            hint="resume at the first line of the sequence, or after the next G0, G1 or G80",
        )
    known = tuple(abs(a - b) < SAME_MM for a, b in zip(here.work_mm, there.work_mm, strict=True))
    lost = [AXES[i] for i in range(facts.axis_count) if not known[i] and (here.moved[i] or there.moved[i])]
    if lost:
        raise JobError(
            f"where {' and '.join(lost)} should be is unknown: it depends on the position at the start of the job",
            hint="relative moves (G91), G28, G30 and G53 cause this; resume after a line with absolute coordinates",
        )
    top, other = (state.top_z_mm - (state.machine_mm[Z] - state.work_mm[Z]) for state in (here, there))
    return _Known(here, known, top if abs(top - other) < SAME_MM else None)


def _run(
    library: ctypes.CDLL, lines: Iterable[JobLine], facts: MachineFacts, start_mm: Sequence[float],
    perturb: bool = False,
) -> ModalState:  # fmt: skip
    """The state after the lines, begun at a place."""
    with _begun(library, facts, start_mm, perturb) as rebuild:
        for job_line in lines:
            if code := rebuild.line(job_line.wire[:-1]):
                raise JobError(f"{job_line.title}, before the resume: {error_words(code)}")
        return rebuild.state()


def _begun(library: ctypes.CDLL, facts: MachineFacts, start_mm: Sequence[float], perturb: bool = False) -> Rebuild:
    """A parser at a place. perturb: with offsets other than those of the first run."""
    rebuild = Rebuild(library, facts.axis_count)
    rebuild.set_position(start_mm)
    for row, values in facts.offsets.items():
        rebuild.set_offset(row, values)
    if perturb:
        for row in ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30"):
            rebuild.set_offset(row, [3.0 * value for value in ELSEWHERE_MM])
    if code := rebuild.line("".join(facts.modes).encode()):
        raise JobError(f"the modes in which the job began, {' '.join(facts.modes)}: {error_words(code)}")
    return rebuild


def _row(facts: MachineFacts, row: str) -> tuple[float, ...]:
    return (*facts.offsets.get(row, ()), *[0.0] * len(AXES))[: len(AXES)]


def _preamble(known: _Known, facts: MachineFacts, approach: Approach) -> list[str]:
    """The lines in front of line N. All in mm and absolute, until the last ones."""
    state = known.state
    safe = _safe_z(known, facts, approach)
    spindle = _spindle(state, facts, approach)
    lines = [f"G21G90G94G17{state.wcs}"]
    if abs(state.tool_length_mm - (facts.offsets.get("TLO") or (0.0,))[0]) > SAME_MM:
        lines.append(f"G43.1Z{number(state.tool_length_mm)}" if state.tool_length_mm else "G49")
    lines += [f"G0Z{number(safe)}"] if safe is not None else []
    lines += [f"T{state.tool}"] if state.tool else []
    lines += [] if facts.laser else spindle
    across = [f"{AXES[i]}{number(state.work_mm[i])}" for i in range(facts.axis_count) if i != Z and known.axes[i]]
    lines += ["G0" + "".join(across)] if across else []
    lines += state.coolant
    if safe is not None and known.axes[Z] and state.work_mm[Z] < safe - SAME_MM:
        down = number(state.work_mm[Z])
        lines.append(f"G0Z{down}" if facts.laser else f"G1Z{down}F{number(approach.plunge_mm_min)}")
    return [*lines, *_modal_words(state), *(spindle if facts.laser else [])]


def _safe_z(known: _Known, facts: MachineFacts, approach: Approach) -> float | None:
    """Where to cross over the work; None when the job has not moved Z and no one asked. Never below where Z is."""
    if facts.axis_count <= Z:
        return None
    state = known.state
    offset_z = state.machine_mm[Z] - state.work_mm[Z]
    here = facts.machine_mm[Z] - offset_z if facts.offsets else facts.work_mm[Z]
    if approach.safe_z_mm is not None:
        return max(here, approach.safe_z_mm)
    if known.top_work_mm is not None:
        return max(here, known.top_work_mm)
    if math.isnan(state.top_z_mm):
        return None
    raise JobError("no safe height found in the lines before", hint="give it: --safe-z MM, work coordinates")


def _spindle(state: ModalState, facts: MachineFacts, approach: Approach) -> list[str]:
    """Spindle (or beam) on, and time to run up."""
    speed = f"S{number(state.spindle_rpm)}" if state.spindle_rpm else ""
    if state.spindle == "M5":
        return [speed] if speed else []
    wait = [] if facts.laser or not approach.spindle_wait_s else [f"G4P{number(approach.spindle_wait_s)}"]
    return [f"{state.spindle}{speed}", *wait]


def _modal_words(state: ModalState) -> list[str]:
    """The modes of line N, where they differ from the preamble's. F is in mm, so it comes before G20."""
    per_rev = "G95" if state.feed_mode == "G95" else ""
    lines = [f"{per_rev}F{number(float(f'{state.feed_mm_min:.6g}'))}"]  # the core keeps it in single precision
    modes = [
        word for word, usual in ((state.plane, "G17"), (state.distance, "G90"), (state.units, "G21")) if word != usual
    ]
    modes += ["G90.1"] if state.arc_absolute else []
    if state.path != "G64":
        modes.append(state.path)
    elif state.path_tolerance_mm:
        lines.append(f"G64P{number(state.path_tolerance_mm)}")
    lines += ["".join(modes)] if modes else []
    if _motion_stands_alone(state):
        lines.append(state.motion)
    return lines + ([state.feed_mode] if state.feed_mode not in ("G94", "G95") else [])


def _motion_stands_alone(state: ModalState) -> bool:
    """Whether the motion word can be sent without a motion: arcs and probes cannot, and G1 needs its F."""
    return state.motion in ("G0", "G80") or (state.motion == "G1" and state.feed_mm_min > 0)


def _with_motion(state: ModalState, rest: Sequence[JobLine]) -> list[JobLine]:
    """Give the first line that relies on the motion mode its word, when that could not be sent before."""
    lines = list(rest)
    if _motion_stands_alone(state):
        return lines
    for i, job_line in enumerate(lines):
        words = words_of(job_line.code)
        codes = {value for letter, value in words if letter == "G"}
        if codes & MOTION_CODES or ("M", 2.0) in words or ("M", 30.0) in words:
            break
        if any(letter in AXES for letter, _ in words) and not codes & AXES_FOR_OTHERS:
            lines[i] = replace(job_line, wire=state.motion.encode() + job_line.wire)
            break
    return lines


def _check(library: ctypes.CDLL, known: _Known, preamble: Sequence[str], facts: MachineFacts) -> None:
    """The preamble through the same parser must end where the lines before did."""
    state = _run(library, [_job_line(code) for code in preamble], facts, facts.machine_mm)
    motion = known.state.motion if _motion_stands_alone(known.state) else state.motion
    wanted = replace(known.state, motion=motion)
    for name in ("motion", "path", "wcs", "plane", "units", "distance", "feed_mode", "spindle", "coolant", "tool",
                 "arc_absolute"):  # fmt: skip
        _same(name, getattr(state, name), getattr(wanted, name))
    for name in ("feed_mm_min", "spindle_rpm", "tool_length_mm", "path_tolerance_mm"):
        _near(name, getattr(state, name), getattr(wanted, name))
    for i in range(facts.axis_count):
        if known.axes[i]:
            _near(AXES[i], state.work_mm[i], wanted.work_mm[i])


def _same(name: str, got: object, wanted: object) -> None:
    if got != wanted:
        raise JobError(f"the resume would set {name} to {got} instead of {wanted}", hint="please report this job")


def _near(name: str, got: float, wanted: float) -> None:
    if abs(got - wanted) > max(CHECK_MM, 1e-6 * abs(wanted)):
        _same(name, got, wanted)


def _notes(known: _Known) -> tuple[str, ...]:
    notes = []
    if known.state.stored:
        notes.append(
            "lines before store offsets (G10, G28.1, G30.1) or use the tool table (G43):"
            " they are assumed to be stored in the controller already"
        )
    still = [axis for axis, is_known in zip(AXES[:3], known.axes, strict=False) if not is_known]
    if still:
        notes.append(f"{' and '.join(still)} does not move: the lines before do not position it")
    return tuple(notes)


def number(value: float) -> str:
    """12.5, -0.00254, 3: at most five decimals, no trailing zeros, no exponent."""
    text = f"{value:.5f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _job_line(code: str) -> JobLine:
    return JobLine(0, code, code.encode("ascii") + b"\n")
