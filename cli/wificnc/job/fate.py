"""What became of the lines of a job that did not end well, in words."""

from __future__ import annotations

import ctypes

from wificnc.job.program import Program
from wificnc.job.resume import Approach, MachineFacts, nearest_resume
from wificnc.job.run import End, Outcome

EXPAND_FIRST = "To resume later: `wificnc expand FILE -o OUT` writes plain lines, and a job of those can be resumed."
RESUMABLE = "To resume later: --from-line"


def fate_lines(outcome: Outcome, restart: str = "") -> list[str]:
    """Nothing for a job that finished. restart: where it may be resumed, as restart_words() reports."""
    if outcome.end is End.FINISHED:
        return []
    lines = [f"{outcome.end.value}: {outcome.detail}" if outcome.detail else outcome.end.value]
    lines.append(_acknowledged(outcome))
    if outcome.unanswered:
        lines.append(_unanswered(outcome))
    return [*lines, restart] if restart else lines


def wanted_line(outcome: Outcome) -> int | None:
    """The first line that is not certain to be done; None: the job itself has not begun, or has finished."""
    if outcome.end is End.FINISHED or outcome.last_answered is None or not outcome.last_answered.number:
        return None
    oldest_planned = max(1, outcome.last_answered.number - outcome.planner_blocks)
    line = outcome.running.number if outcome.running else oldest_planned
    return min(line, outcome.refused.number) if outcome.refused else line


def restart_words(
    library: ctypes.CDLL, program: Program, wanted: int, facts: MachineFacts, approach: Approach | None = None
) -> str:
    """Where --from-line can resume a program that stopped at the wanted line, and why not there."""
    if program.expanded or program.computes:
        return EXPAND_FIRST
    found = nearest_resume(library, program, wanted, facts, approach)
    if found.line == wanted:
        return f"{RESUMABLE} {wanted}, or an earlier line with a safe approach."
    why_not = f"Line {wanted} cannot be resumed: {found.why_not}."
    if found.line is None or found.at_begin:
        return (
            "--from-line cannot resume this job; send it from the beginning, with the axes at its start position."
            f" {why_not}"
        )
    return f"{RESUMABLE} {found.line}. {why_not}"


def _acknowledged(outcome: Outcome) -> str:
    last = outcome.last_accepted
    doubt = " (its ok may be from the reset)" if outcome.end is End.RESET else ""
    text = f"Last line acknowledged: {last.title}{doubt}." if last else "No line was acknowledged."
    if outcome.refused:
        text += f" {_capital(outcome.refused.title)} was refused and had no effect."
    if last is None:
        return text
    if outcome.running:
        text += f" In the last report the machine was in {outcome.running.title}."
    if outcome.end is End.LINK_LOST:
        return (
            f"{text} A controller that detects the lost connection holds the program; on a serial port it continues"
            " with the lines that it has received."
        )
    if outcome.end is End.TAKEN:
        return (
            f"{text} The controller continues with the lines that it has received; the other client can hold or end"
            " them."
        )
    if outcome.running:
        return text
    ahead = f"the last {outcome.planner_blocks} moves of" if outcome.planner_blocks else "the last moves of"
    return f"{text} It was in the look-ahead: {ahead} the acknowledged lines may not have been executed."


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _unanswered(outcome: Outcome) -> str:
    first, last = outcome.unanswered[0], outcome.unanswered[-1]
    which = first.title if first is last else f"{first.title} to {last.title}"
    if outcome.end in (End.LINK_LOST, End.TAKEN):
        return f"Sent and not acknowledged: {which}. They may still be executed, in whole or in part."
    return f"Sent and not acknowledged: {which}. The first may have been started; the others were not."
