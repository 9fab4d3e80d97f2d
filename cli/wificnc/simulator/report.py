"""A SimResult in words and figures: the JSON document and the rows of the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from wificnc.simulator.job import Engraving, LineError, SimEvent, SimResult, ToolChange

ByAxis = Callable[[Sequence[float]], dict[str, float]]

TOOL_CHANGES_SHOWN = 8
LASER_HINT = (
    "use M4, whose power follows the speed, or a lower F, "
    "or overscan: begin and end lines outside of the picture with S0"
)
DWELL_SHOWN_S = 0.01  # a shorter part of the job is not worth a word


def report_json(result: SimResult) -> dict[str, Any]:
    """The document of --json; axes by letter. The keys are a contract with scripts."""

    def by_axis(values: Sequence[float]) -> dict[str, float]:
        return dict(zip(result.axes, values, strict=True))

    warned = (laser_warning(result) or ())[:1]
    return {
        "file": result.file,
        "lines": result.lines,
        "lines_not_run": result.ending.unrun,
        "blocks": result.blocks,
        "segments": result.segments,
        "steps_per_axis": by_axis(result.steps_per_axis),
        "final_position_mm": by_axis(result.final_position_mm),
        "final_position_steps": by_axis(result.final_position_steps),
        "bounding_box_mm": {"min": by_axis(result.box_min_mm), "max": by_axis(result.box_max_mm)},
        "job_time_s": result.job_time_s,
        "cutting_time_s": result.cutting_time_s,
        "rapid_time_s": result.rapid_time_s,
        "max_speed_mm_s": by_axis(result.max_speed_mm_s),
        "max_accel_mm_s2": by_axis(result.max_accel_mm_s2),
        "max_accel_window_s": by_axis(result.accel_window_s),
        "max_accel_resolution_mm_s2": by_axis(result.accel_resolution_mm_s2),
        "max_step_rate_hz": result.max_step_rate_hz,
        "lookahead_starved": result.lookahead_starved,
        "underruns": result.underruns,
        "plan_unmet": result.plan_unmet,
        "tool_changes": [asdict(change) for change in result.tool_changes],
        "errors": [asdict(error) for error in result.errors],
        "laser": _laser_json(result.engraving) if result.engraving else None,
        "warnings": [*result.warnings, *warned],
        "events": [_event_json(event, by_axis) for event in result.events],
    }


def _event_json(event: SimEvent, by_axis: ByAxis) -> dict[str, Any]:
    return {
        **{key: getattr(event, key) for key in ("time_s", "action", "done", "state")},
        "position_mm": by_axis(event.position_mm),
        "position_steps": by_axis(event.position_steps),
    }


def _laser_json(engraving: Engraving) -> dict[str, Any]:
    worst = {
        "times": engraving.worst,
        "line": engraving.worst_line,
        "position_mm": dict(zip("XYZ", engraving.worst_mm, strict=True)),
    }
    return {
        "length_mm": engraving.length_mm,
        "constant_power_mm": engraving.constant_mm,
        "slow_mm": engraving.slow_mm,
        "limit": engraving.limit,
        "worst": worst if engraving.worst else None,
    }


def laser_warning(result: SimResult) -> tuple[str, str] | None:
    """What constant power burns too much, and how to avoid it."""
    burnt = result.engraving
    if burnt is None or burnt.slow_mm == 0:
        return None
    place = " ".join(f"{axis}{mm:.3f}" for axis, mm in zip("XYZ", burnt.worst_mm, strict=True))
    message = (
        "constant power (M3) burns more where the machine is slower than F: more than "
        f"{burnt.limit:g} x the energy of the feed on {burnt.slow_mm:.1f} mm of {burnt.constant_mm:.1f} mm, "
        f"at most {burnt.worst:.1f} x in line {burnt.worst_line} at {place}"
    )
    return message, LASER_HINT


def summary_rows(result: SimResult) -> list[tuple[str, str]]:
    """What the table says about the whole job."""
    times = [("cutting", result.cutting_time_s), ("rapids", result.rapid_time_s), ("dwell", result.dwell_time_s)]
    parts = [f"{name} {duration(seconds)}" for name, seconds in times if seconds >= DWELL_SHOWN_S]
    rows = [
        ("job time", duration(result.job_time_s) + (f"  ({', '.join(parts)})" if parts else "")),
        ("program", f"{result.lines:,} lines, {result.blocks:,} moves, {result.segments:,} segments"),
        ("steps", f"{result.step_events:,} step events, at most {result.max_step_rate_hz:,.0f} Hz on one axis"),
    ]
    rows += acceleration_rows(result)
    if result.lookahead_starved:
        rows.append(("look-ahead", f"ran out {result.lookahead_starved:,} times"))
    if result.tool_changes:
        rows.append(("tools", _tool_changes(result.tool_changes)))
    if result.underruns:
        rows.append(("underruns", f"motion slowed down {result.underruns:,} times because the controller was busy"))
    if result.plan_unmet:
        rows.append(("planner", f"the plan exceeded the limits {result.plan_unmet:,} times: please report"))
    rows += [
        (f"at {duration(event.time_s)}", f"{event.action}: {event.state}") for event in result.events if event.done
    ]
    return rows


def _tool_changes(changes: Sequence[ToolChange]) -> str:
    """T1 in line 3, T2 in line 57 and 4 more changes"""
    shown = ", ".join(change.title for change in changes[:TOOL_CHANGES_SHOWN])
    more = len(changes) - TOOL_CHANGES_SHOWN
    return shown + (f" and {more} more change{'s' * (more != 1)}" if more > 0 else "")


def acceleration_rows(result: SimResult) -> list[tuple[str, str]]:
    """How the figure of each moving axis was measured: axes of one window in one phrase."""
    groups: dict[str, list[str]] = {}
    for i, axis in enumerate(result.axes):
        if result.steps_per_axis[i]:
            grain = f"±{result.accel_resolution_mm_s2[i]:,.0f} mm/s² of single steps"
            groups.setdefault(f"{1000 * result.accel_window_s[i]:.0f} ms ({grain})", []).append(axis)
    phrases = [f"{' '.join(axes)} over {text}" for text, axes in groups.items()]
    return [("acceleration", f"measured: {', '.join(phrases)}")] if phrases else []


AXIS_COLUMNS = ("axis", "from mm", "to mm", "ends at mm", "pulses", "max mm/min", "max mm/s²")


def axis_rows(result: SimResult) -> list[tuple[str, ...]]:
    """A row for each axis that moves; for X when none does."""
    moving = [i for i in range(len(result.axes)) if result.steps_per_axis[i]] or [0]
    return [
        (
            result.axes[i],
            f"{result.box_min_mm[i]:.3f}",
            f"{result.box_max_mm[i]:.3f}",
            f"{result.final_position_mm[i]:.3f}",
            f"{result.steps_per_axis[i]:,}",
            f"{60 * result.max_speed_mm_s[i]:,.0f}",
            f"{result.max_accel_mm_s2[i]:,.0f}",
        )
        for i in moving
    ]


def error_line(file: str, error: LineError) -> str:
    """job.nc:12: error:22 the feed rate is missing (F); without a line when all of them had been answered"""
    where = f"{file}:{error.line}" if error.line else file
    return f"{where}: {error.title}"


def duration(seconds: float) -> str:
    """4.213 s, 2 min 05.3 s, 1 h 02 min 03 s"""
    if round(seconds, 3) < 60:
        return f"{seconds:.3f} s"
    if round(seconds, 1) < 3600:
        minutes, rest = divmod(round(seconds, 1), 60)
        return f"{int(minutes)} min {rest:04.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60:02d} min {rest:02d} s"
