"""From the options of `wificnc check` to a report."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.board.rules import pulse_rate_hz
from wificnc.build.host import ensure_host_library
from wificnc.errors import UserError
from wificnc.job.program import read_program
from wificnc.profile import load_machine
from wificnc.profile.model import Machine
from wificnc.simulator.check import judge
from wificnc.simulator.check.finding import Finding, Severity
from wificnc.simulator.check.words import surely_wrong
from wificnc.simulator.job import JobRequest, Progress, SimResult, read_job, run_job
from wificnc.simulator.library import load_library
from wificnc.simulator.run import board_timing, check_axes, parse_at, parse_setting
from wificnc.tables import load_settings

WORD = re.compile(r"([XYZABC])\s*([-+]?(?:\d+\.?\d*|\.\d+))", re.IGNORECASE)
SEPARATORS = re.compile(r"[\s,]*")


@dataclass(frozen=True)
class CheckOptions:
    """What the user asked for."""

    file: Path
    machine: str | None  # None: only what no machine can do is looked for
    board: str = "host"
    settings: tuple[str, ...] = ()
    work_zero: str | None = None
    at: tuple[str, ...] = ()
    lines_max: int | None = None


@dataclass(frozen=True)
class CheckReport:
    """What is wrong, and the figures of the run."""

    result: SimResult
    machine: str | None
    board: str
    work_zero: bool  # known
    step_rate_limit_hz: float
    extents: tuple[judge.Extent, ...]  # of the axes that move
    findings: tuple[Finding, ...]

    def count(self, severity: Severity) -> int:
        return sum(finding.severity is severity for finding in self.findings)


def check_job(options: CheckOptions, on_progress: Progress | None = None) -> CheckReport:
    """Run the whole job, whatever it does, and judge it.

    Raises:
        UserError: an option, the board or the machine cannot be.
        JobError: the file cannot be read.
    """
    zero = parse_work_zero(options.work_zero) if options.work_zero else None
    settings = tuple(parse_setting(text) for text in options.settings)
    text = read_job(options.file)
    program = read_program(options.file.name, text)  # refuses what `wificnc send` refuses
    board = load_board(options.board)
    machine = load_machine(options.machine) if options.machine else None
    check_axes(board, machine)
    timing = board_timing(board)
    own = (*(machine.settings_lines() if machine else ()), *settings)
    soft_limits_off = f"${load_settings()['soft_limits'].number}=0"  # an alarm would hide all that comes after it
    request = JobRequest(
        file=str(options.file),
        text=text,
        timing=timing,
        settings=(*own, soft_limits_off),
        keep_going=True,
        lines_max=options.lines_max,
        events=tuple(parse_at(at) for at in options.at),
        survey=True,
        commands=(zero,) if zero else (),
    )
    result = run_job(load_library(ensure_host_library()), request, on_progress)
    extents = tuple(_extents(result, machine))
    found = _findings(result, text, machine, extents, zero is not None)
    return CheckReport(
        result=result,
        machine=machine.name if machine else None,
        board=board.id,
        work_zero=zero is not None,
        step_rate_limit_hz=pulse_rate_hz(board, (machine.stepper.step_pulse_us if machine else None) or 0),
        extents=extents,
        findings=tuple(judge.ordered([*found, *surely_wrong(program.lines, (_values if machine else _given)(own))])),
    )


def _values(lines: Iterable[str]) -> dict[int, float]:
    """$N=V lines, over the defaults."""
    rows = load_settings().setting
    values = {row.number + i: float(row.default) for row in rows for i in range(row.count) if row.number in (30, 110)}
    return values | _given(lines)


def _given(lines: Iterable[str]) -> dict[int, float]:
    return {int(number): float(value) for number, value in (line[1:].split("=") for line in lines)}


def parse_work_zero(text: str) -> str:
    """'X-100 Y-50' as the line that puts the zero of G54 there. Raises UserError."""
    words = WORD.findall(text)
    if not words or SEPARATORS.sub("", WORD.sub("", text)):
        raise UserError(
            f"--work-zero {text!r} is not a position",
            hint="like X-100Y-50Z-20: where the job's zero lies in machine coordinates",
        )
    return "G21G10L2P1" + "".join(f"{letter.upper()}{number}" for letter, number in words)


def _findings(
    result: SimResult, text: bytes, machine: Machine | None, extents: tuple[judge.Extent, ...], zero_known: bool
) -> list[Finding]:
    rows = result.survey_lines
    found = [*judge.refused(result.errors, result.survey_arcs), *judge.too_large(extents)]
    if zero_known:
        found += judge.beyond(rows, extents)
    else:
        found += judge.machine_moves(text)
    found += [*(judge.slow(rows) if machine else ()), *judge.laser(result)]
    found += judge.unrun(result.ending, result.lines)
    return [*found, *judge.tool_changes(result.tool_changes), *judge.remarks(result, text)]


def _extents(result: SimResult, machine: Machine | None) -> list[judge.Extent]:
    rows = result.survey_lines
    extents = []
    for index, axis in enumerate(result.axes):
        low = min((row.min_mm[index] for row in rows), default=0.0)
        high = max((row.max_mm[index] for row in rows), default=0.0)
        if result.steps_per_axis[index] or low != high:
            extents.append(judge.Extent(axis, low, high, machine.travel_mm[index] if machine else None))
    return extents
