"""What a run says about the lines of a job. Pure: survey rows in, findings out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from wificnc.job.ending import Ending
from wificnc.job.refusal import refusal_hint
from wificnc.simulator.check.arcs import arc_hint
from wificnc.simulator.check.finding import Finding, Severity
from wificnc.simulator.job import LineError, SimResult, ToolChange
from wificnc.simulator.library import AXES, SurveyArc, SurveyLine
from wificnc.simulator.report import laser_warning

REACHED = 0.98  # of the feed asked for: no one misses the rest
GAINED = 0.9  # where only the acceleration is in the way, a little less is nothing to tell
ROUNDING_MM = 2e-4  # of float32 positions up to 2 m
CLAMPED = re.compile(r"\$11\d is limited")
NO_COOLANT = re.compile("This board has no (flood|mist) output")
NO_COOLANT_HINT = "the job cuts without coolant; take the code out, or use a board with that output"
COOLANT_CODES = {
    name: re.compile(rb"(?i)^[^(;\r\n]*?M\s*0?%d(?![.\d])" % code, re.MULTILINE)
    for name, code in (("mist", 7), ("flood", 8))
}
MACHINE_COORDINATES = re.compile(rb"(?i)^[^(;\r\n]*?\bG\s*(?:53|28|30)(?![.\d])", re.MULTILINE)


@dataclass(frozen=True)
class Extent:
    """Where an axis goes in a job, and where its work zero may lie (machine coordinates) so that all of it fits."""

    axis: str
    min_mm: float
    max_mm: float
    travel_mm: float | None

    @property
    def fits(self) -> bool:
        return self.travel_mm is None or self.max_mm - self.min_mm <= self.travel_mm + ROUNDING_MM

    @property
    def zero_mm(self) -> tuple[float, float] | None:
        """None: endless, not known, or it fits nowhere. Of a job whose work zero is 0."""
        if self.travel_mm is None or not self.fits:
            return None
        return -self.travel_mm - self.min_mm, -self.max_mm


def refused(errors: Iterable[LineError], arcs: Iterable[SurveyArc]) -> Iterator[Finding]:
    """Lines that the controller refuses. After the first refused move, others may only follow from it."""
    hints = {arc.line: arc_hint(arc) for arc in arcs}
    first = 0
    for error in errors:
        hint = hints.get(error.line)
        if hint and first:
            hint = f"may follow from line {first}, whose move is missing; else {hint}"
        hint = hint or (refusal_hint(error.code) if error.code else None)
        yield Finding("refused", Severity.ERROR, error.line, error.line, f"{error.title}: {error.text.strip()}", hint)
        first = first or error.line


def beyond(rows: Sequence[SurveyLine], extents: Iterable[Extent]) -> Iterator[Finding]:
    """Lines that leave the travel, 0 to -travel, of a machine that knows where its work zero lies."""
    for extent in extents:
        if extent.travel_mm is None:
            continue
        index, lowest_mm = AXES.index(extent.axis), -extent.travel_mm - ROUNDING_MM

        def side(row: SurveyLine, index: int = index, lowest_mm: float = lowest_mm) -> int:
            return int(row.max_mm[index] > ROUNDING_MM) - int(row.min_mm[index] < lowest_mm)

        for where, group in groupby(rows, key=side):
            if where:
                yield _beyond(list(group), extent, index, where)


def _beyond(rows: list[SurveyLine], extent: Extent, index: int, where: int) -> Finding:
    unit = "mm" if extent.axis in "XYZ" else "deg"
    travel = extent.travel_mm or 0.0
    far = max(row.max_mm[index] for row in rows) if where > 0 else min(row.min_mm[index] for row in rows)
    message = f"{extent.axis} goes to {far:.3f} {unit} in machine coordinates; its travel is {-travel:g} to 0"
    whole = -extent.max_mm if where > 0 else -travel - extent.min_mm
    hint = f"move the work zero by {whole:+.3f} {unit} in {extent.axis}" if extent.fits else None
    return Finding("travel", Severity.ERROR, rows[0].line, rows[-1].line, message, hint, _time(rows))


def too_large(extents: Iterable[Extent]) -> Iterator[Finding]:
    """Axes whose way is longer than their travel, wherever the work zero lies."""
    for extent in extents:
        if not extent.fits:
            unit = "mm" if extent.axis in "XYZ" else "deg"
            way = f"{extent.max_mm - extent.min_mm:.3f} {unit}"
            message = f"{extent.axis} moves over {way}; this machine's travel is {extent.travel_mm:g} {unit}"
            yield Finding("travel", Severity.ERROR, 0, 0, message, "make the job smaller, or split it")


def slow(rows: Iterable[SurveyLine]) -> Iterator[Finding]:
    """Feeds that are asked for and never reached: rows of lines with one feed and one cause."""
    for (missed, asked, motors), group in groupby(_with_merged(rows), key=lambda run: _cause(run.row)):
        if missed:
            yield _slow(list(group), asked, motors)


@dataclass(frozen=True)
class _Run:
    """A line, and those after it that the planner has made one chord with it: the first line stands for all."""

    row: SurveyLine
    last_line: int


def _with_merged(rows: Iterable[SurveyLine]) -> Iterator[_Run]:
    run: _Run | None = None
    for row in rows:
        if run and row.time_s == 0 and row.asked_mm_s == run.row.asked_mm_s:
            run = replace(run, last_line=row.line)
            continue
        if run:
            yield run
        run = _Run(row, row.line) if row.asked_mm_s > 0 and row.time_s > 0 else None
    if run:
        yield run


def _cause(row: SurveyLine) -> tuple[bool, float, int]:
    missed = row.reached_mm_s < (REACHED if row.at_rate else GAINED) * row.asked_mm_s
    return missed, row.asked_mm_s, row.at_rate if missed else 0


def _slow(runs: list[_Run], asked_mm_s: float, motors: int) -> Finding:
    rows = [run.row for run in runs]
    reached_mm_s = max(row.reached_mm_s for row in rows)
    names = " and ".join(axis for bit, axis in enumerate(AXES) if motors >> bit & 1)
    message = f"F{60 * asked_mm_s:.0f} is never reached; at most {60 * reached_mm_s:.0f}: "
    where = (rows[0].line, runs[-1].last_line)
    if motors:
        many = " and " in names
        message += f"{names} {'run at their' if many else 'runs at its'} maximum rate"
        settings = ", ".join(f"$11{bit}" for bit in range(len(AXES)) if motors >> bit & 1)
        hint = f"use a feed that {names} can reach, or raise {settings}"
        return Finding("feed-rate", Severity.WARNING, *where, message, hint, _time(rows))
    message += "the path is too short or too curved for the acceleration"
    return Finding("feed-acceleration", Severity.NOTE, *where, message, None, _time(rows))


def laser(result: SimResult) -> Iterator[Finding]:
    """Constant power where the machine is slower than the feed."""
    if result.engraving and (warned := laser_warning(result)):
        line = result.engraving.worst_line
        yield Finding("laser-energy", Severity.WARNING, line, line, *warned)


def _time(rows: Iterable[SurveyLine]) -> float:
    return float(sum(row.time_s for row in rows))


def remarks(result: SimResult, program: bytes) -> Iterator[Finding]:
    """What the controller said by the way."""
    for text in result.warnings:
        if text == result.ending.words:
            continue  # unrun()
        if CLAMPED.match(text):
            yield Finding(
                "step-rate", Severity.WARNING, 0, 0, text, "use less microstepping, or a board with a higher step rate"
            )
        elif found := NO_COOLANT.match(text):
            line = first_line_with(COOLANT_CODES[found[1]], program)
            yield Finding("coolant", Severity.WARNING, line, line, text, NO_COOLANT_HINT)
        else:
            yield Finding("message", Severity.NOTE, 0, 0, text)


def unrun(ending: Ending, file_lines: int) -> Iterator[Finding]:
    """What follows the program's end in the file."""
    if ending.unrun:
        yield Finding("not-run", Severity.WARNING, ending.first, file_lines, ending.words, ending.hint)


def tool_changes(changes: Iterable[ToolChange]) -> Iterator[Finding]:
    """Where the machine waits for an operator."""
    for change in changes:
        yield Finding("tool-change", Severity.NOTE, change.line, change.line, f"tool change: T{change.tool}")


def first_line_with(code: re.Pattern[bytes], text: bytes) -> int:
    """Its number; 0: no line has the code."""
    found = code.search(text)
    return text[: found.start()].count(b"\n") + 1 if found else 0


def machine_moves(text: bytes) -> Iterator[Finding]:
    """G53, G28 and G30 mean machine coordinates, which say nothing before the work zero is known."""
    if line := first_line_with(MACHINE_COORDINATES, text):
        message = "this job moves in machine coordinates, so its extent depends on the work zero"
        yield Finding("work-zero", Severity.NOTE, line, line, message, "give it with --work-zero X-100Y-50Z-20")


def ordered(findings: Iterable[Finding]) -> list[Finding]:
    """Errors first, then by line; of what only takes time the longest first."""
    ranks = list(Severity)

    def key(finding: Finding) -> tuple[int, float]:
        is_note = finding.severity is Severity.NOTE
        return ranks.index(finding.severity), -finding.time_s if is_note else float(finding.first_line)

    return sorted((replace(finding) for finding in findings), key=key)
