"""The machine profile of a configuration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from wificnc.board.fluidnc.axes import LINEAR, AxisFacts
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section

_KINEMATICS = {"cartesian": "cartesian", "corexy": "corexy"}
_PULSE_US_MAX, _IDLE_MS_MAX = 255, 255
_HOMED_AT = "machine coordinates after homing: here 0 is at the positive end of an axis, and mpos_mm is not taken"


def profile_data(
    root: Section, axes: Sequence[AxisFacts], spindle: dict[str, Any], coolant: dict[str, Any], remarks: Remarks
) -> dict[str, Any]:
    """The tables of the profile, without empty ones."""
    tables = {
        "axis": {facts.letter.lower(): facts.profile for facts in axes},
        "kinematics": _kinematics(root, remarks),
        "motion": _motion(root),
        "stepper": _stepper(root.section("stepping"), remarks),
        "limits": _limits(axes, remarks),
        "homing": _homing(axes, remarks),
        "spindle": spindle,
        "coolant": coolant,
    }
    name = root.title("name", remarks) or root.title("board", remarks) or "imported"
    return {"schema": 1, "name": name, **{key: table for key, table in tables.items() if table}}


def _kinematics(root: Section, remarks: Remarks) -> dict[str, Any]:
    section = root.section("kinematics")
    name = next(iter((*section.sections, *section.values)), None)
    if name is None:
        return {}
    if name not in _KINEMATICS:
        remarks.lost("kinematics", section.line, f"{name} is not supported ($80): motors are axes")
        section.skip_all()
        return {}
    section.section(name)
    section.skip_all()
    return {} if name == "cartesian" else {"type": _KINEMATICS[name]}


def _motion(root: Section) -> dict[str, Any]:
    names = ("junction_deviation_mm", "arc_tolerance_mm")
    return {name: value for name in names if (value := root.number(name)) is not None}


def _stepper(stepping: Section, remarks: Remarks) -> dict[str, Any]:
    made: dict[str, Any] = {}
    pulse_us, idle_ms = stepping.number("pulse_us"), stepping.number("idle_ms")
    if pulse_us is not None and pulse_us >= 1:
        made["step_pulse_us"] = min(int(pulse_us), _PULSE_US_MAX)
    if idle_ms is not None:
        made["idle_delay_ms"] = min(int(idle_ms), _IDLE_MS_MAX)
        if idle_ms > _IDLE_MS_MAX:
            why = f"{idle_ms:g} ms; $1 takes 254 ms at most: 255, the motors stay on"
            remarks.changed("stepping.idle_ms", stepping.line_of("idle_ms"), why)
    return made


def _limits(axes: Sequence[AxisFacts], remarks: Remarks) -> dict[str, Any]:
    made: dict[str, Any] = {}
    linear = [facts for facts in axes if facts.letter in LINEAR]
    homed = any(facts.cycle > 0 for facts in axes)
    soft = [facts.letter for facts in linear if facts.soft]
    if soft and len(soft) == len(linear) and homed:
        made["soft"] = True
    elif soft:
        why = "soft limits are for all axes here ($20), and need homing" if homed else "soft limits need homing ($22)"
        remarks.lost(f"axes.{soft[0].lower()}.soft_limits", axes[0].line, f"{', '.join(soft)}: {why}")
    hard = [any(facts.hard) for facts in axes]
    if any(hard):
        made["hard"] = True
        if not all(hard):
            remarks.changed("axes", axes[0].line, "hard limits of some axes: here of all that have a switch ($21)")
    return made


def _homing(axes: Sequence[AxisFacts], remarks: Remarks) -> dict[str, Any]:
    homed = [facts for facts in axes if facts.cycle > 0]
    for facts in homed:
        if not any(name.startswith("limit") for motor in facts.motors for name in motor):
            remarks.lost(
                f"axes.{facts.letter.lower()}.homing",
                facts.line,
                "is homed without a switch (by the driver, or by that of another axis)",
            )
            facts.profile.pop("home_at")
    homed = [facts for facts in homed if "home_at" in facts.profile]
    if not homed:
        return {}
    cycles = sorted({facts.cycle for facts in homed})
    made: dict[str, Any] = {"enabled": True}
    values: tuple[tuple[str, Callable[[AxisFacts], float | None], Callable[..., float], str], ...] = (
        ("feed_mm_min", lambda facts: facts.feed, min, "the slowest"),
        ("seek_mm_min", lambda facts: facts.seek, min, "the slowest"),
        ("debounce_ms", lambda facts: facts.settle_ms, max, "the longest"),
        ("pull_off_mm", lambda facts: max(facts.pull_off, default=None), max, "the longest"),
    )
    for key, of, choose, which in values:
        given = [value for facts in homed if (value := of(facts)) is not None]
        if given:
            made[key] = choose(given)
            if len(set(given)) > 1:
                shown = ", ".join(f"{value:g}" for value in given)
                remarks.changed("axes", homed[0].line, f"{key} of the axes is {shown}: {which} for all here")
    if "debounce_ms" in made:
        made["debounce_ms"] = int(made["debounce_ms"])
    made["order"] = ["".join(facts.letter for facts in homed if facts.cycle == cycle) for cycle in cycles]
    remarks.changed("axes", homed[0].line, _HOMED_AT)
    return made
