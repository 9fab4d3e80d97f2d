"""What became of the lines of a job that did not end well, in words."""

from __future__ import annotations

from wificnc.job.run import End, Outcome


def fate_lines(outcome: Outcome, expanded: bool = False) -> list[str]:
    """Nothing for a job that finished. An expanded one is not resumed by the lines of its file."""
    if outcome.end is End.FINISHED:
        return []
    lines = [f"{outcome.end.value}: {outcome.detail}" if outcome.detail else outcome.end.value]
    lines.append(_acknowledged(outcome))
    if outcome.unanswered:
        lines.append(_unanswered(outcome))
    if expanded:
        lines.append("To go on later: `wificnc expand` the file, and resume what it writes")
    elif (again := _resume_at(outcome)) is not None:
        lines.append(f"To go on later: --from-line {again}, or an earlier line with a safe approach")
    return lines


def _acknowledged(outcome: Outcome) -> str:
    last = outcome.last_answered
    if last is None:
        return "No line was acknowledged."
    doubt = " (its ok may come from the reset itself)" if outcome.end is End.RESET else ""
    text = f"Last line acknowledged: {last.title}{doubt}."
    if outcome.running:
        text += f" When last heard of, the machine was in {outcome.running.title}."
    if outcome.end is End.LINK_LOST:
        return f"{text} It holds if it has seen that; behind a plain serial port it goes on with what it has."
    if outcome.running:
        return text
    ahead = f"the last {outcome.planner_blocks} moves of" if outcome.planner_blocks else "the last moves of"
    return f"{text} It was in the look-ahead: {ahead} what was acknowledged may not have been made."


def _unanswered(outcome: Outcome) -> str:
    first, last = outcome.unanswered[0], outcome.unanswered[-1]
    which = first.title if first is last else f"{first.title} to {last.title}"
    if outcome.end is End.LINK_LOST:
        return f"Sent and not acknowledged: {which}. They may be executed now, in whole or in part."
    return f"Sent and not acknowledged: {which}. The first may have been begun; the others were not."


def _resume_at(outcome: Outcome) -> int | None:
    """The first line that is not certain to be done."""
    if outcome.running:
        return outcome.running.number
    if outcome.last_answered is None or not outcome.last_answered.number:
        return None
    return max(1, outcome.last_answered.number - outcome.planner_blocks)
