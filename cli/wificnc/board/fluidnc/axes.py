"""The axes of a configuration: motors and switches for the board file, and what the machine profile has of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from wificnc.board.fluidnc.drivers import DriverFacts, read_driver
from wificnc.board.fluidnc.pins import take_pin
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section
from wificnc.tables import AXES

LINEAR = "XYZ"
STEP_DIR = ("stepstick", "standard_stepper")
_OTHER_MOTORS = {
    "rc_servo": "an RC servo as a motor: here a servo follows an axis that has step and direction ($85)",
    "solenoid": "a solenoid as a motor",
    "dynamixel2": "a Dynamixel servo as a motor",
    "unipolar": "a unipolar motor without a driver of step and direction",
}
# Ours with mm or deg in place, and FluidNC's default, where a configuration leaves them out.
_NUMBERS = {
    "steps_per_mm": ("steps_per_{}", 80.0),
    "max_rate_mm_per_min": ("max_rate_{}_min", 1000.0),
    "acceleration_mm_per_sec2": ("acceleration_{}_s2", 25.0),
}

_TRAVEL = 1000.0  # FluidNC's default
_CYCLES = range(-1, len(AXES) + 1)  # of homing; 0 and -1: not by $H


@dataclass
class AxisFacts:
    """What one axis contributes."""

    letter: str
    line: int
    motors: list[dict[str, Any]] = field(default_factory=list)  # of the board file
    profile: dict[str, Any] = field(default_factory=dict)  # [axis.x] of the machine profile
    cycle: int = 0  # of homing; 0: not by $H
    feed: float | None = None
    seek: float | None = None
    settle_ms: float | None = None
    pull_off: list[float] = field(default_factory=list)
    soft: bool = False
    hard: list[bool] = field(default_factory=list)
    drivers: list[DriverFacts] = field(default_factory=list)  # of the motors, in their order
    undriven: list[str] = field(default_factory=list)  # motors of kinds that we do not drive


def read_axes(axes: Section, remarks: Remarks) -> list[AxisFacts]:
    """The axes with a motor that we drive, from X on without a gap."""
    found: list[AxisFacts] = []
    for letter in AXES:
        name = letter.lower()
        if name not in axes.sections:
            continue
        part = axes.section(name)
        facts = _read_axis(letter, part, remarks)
        if not facts.motors:
            remarks.lost(part.path, part.line, f"{letter} has no motor with step and direction: the axis is left out")
        else:
            found.append(facts)
    axes.skip("homing_runs")
    return without_gaps(found, remarks)


def without_gaps(axes: Sequence[AxisFacts], remarks: Remarks) -> list[AxisFacts]:
    """From X on, up to the first axis that is missing."""
    found: list[AxisFacts] = []
    for facts in axes:
        if facts.letter == AXES[len(found)]:
            found.append(facts)
        else:
            why = f"{facts.letter} follows an axis that is not there: axes count from X on without a gap"
            remarks.lost(f"axes.{facts.letter.lower()}", facts.line, why)
    return found


def _read_axis(letter: str, part: Section, remarks: Remarks) -> AxisFacts:
    facts = AxisFacts(letter, part.line)
    unit = "mm" if letter in LINEAR else "deg"
    facts.profile = {
        ours.format(unit): part.positive(name, default, remarks) for name, (ours, default) in _NUMBERS.items()
    }
    if "max_travel_mm" in part.values:
        is_endless = letter not in LINEAR and part.number("max_travel_mm") == 0
        travel = 0.0 if is_endless else part.positive("max_travel_mm", _TRAVEL, remarks)
        facts.profile[f"travel_{unit}"] = travel
    facts.soft = part.flag("soft_limits")
    part.skip("idle_disable")
    _read_homing(facts, part, remarks)
    motors = [name for name in ("motor0", "motor1") if name in part.sections]
    for number, name in enumerate(motors):
        _read_motor(facts, part.section(name), remarks, second=number == 1)
    if not motors:
        _read_motor(facts, part, remarks)
    _compare_directions(facts)
    _compare_switches(facts, part, remarks)
    return facts


def _read_homing(facts: AxisFacts, part: Section, remarks: Remarks) -> None:
    if "homing" not in part.sections:
        return
    homing = part.section("homing")
    facts.cycle = homing.whole("cycle")
    if facts.cycle not in _CYCLES:
        why = f"{facts.cycle} is not a homing cycle, which is -1 to {len(AXES)}: the axis is not homed"
        remarks.lost(f"{homing.path}.cycle", homing.line_of("cycle"), why)
        facts.cycle = 0
    if facts.cycle > 0:
        facts.profile["home_at"] = "max" if homing.flag("positive_direction") else "min"
    facts.feed, facts.seek = homing.number("feed_mm_per_min"), homing.number("seek_mm_per_min")
    facts.settle_ms = homing.number("settle_ms")
    homing.skip(
        "positive_direction", "mpos_mm", "seek_scaler", "feed_scaler", "allow_single_axis", "is_square", "square"
    )
    pull_off = homing.number("pulloff_mm")
    if pull_off is not None:
        facts.pull_off.append(pull_off)


def _read_motor(facts: AxisFacts, part: Section, remarks: Remarks, *, second: bool = False) -> None:
    wires = _driver(facts, part, remarks)
    limits = {"limit_neg_pin": "limit_min", "limit_pos_pin": "limit_max", "limit_all_pin": "limit"}
    switches = {ours: pin for name, ours in limits.items() if (pin := take_pin(part, name, remarks))}
    hard, pull_off = part.flag("hard_limits"), part.number("pulloff_mm")
    if wires is None:
        return
    facts.hard.append(hard)
    if pull_off is not None and second and facts.motors:
        facts.profile["second"] = {"pull_off_mm": pull_off}
    elif pull_off is not None:
        facts.pull_off.append(pull_off)
    if "limit" in switches and len(switches) > 1:
        remarks.lost(f"{part.path}.limit_all_pin", part.line, "one line for both ends, next to one for each end")
        del switches["limit"]
    facts.motors.append({**wires, **{name: pin.input() for name, pin in switches.items()}})


def _driver(facts: AxisFacts, part: Section, remarks: Remarks) -> dict[str, Any] | None:
    """Step, direction and enable of the motor; None where it has none."""
    for name, section in part.sections.items():
        if name == "null_motor":
            part.skip(name)
        elif name in STEP_DIR or name.startswith("tmc_"):
            return _step_and_direction(facts, part.section(name), name, remarks)
        elif name in _OTHER_MOTORS:
            part.skip(name)
            facts.undriven.append(section.path)
            remarks.lost(section.path, section.line, _OTHER_MOTORS[name])
    return None


def _step_and_direction(facts: AxisFacts, driver: Section, kind: str, remarks: Remarks) -> dict[str, Any] | None:
    step, direction = take_pin(driver, "step_pin", remarks), take_pin(driver, "direction_pin", remarks)
    disable = take_pin(driver, "disable_pin", remarks)
    registers = read_driver(driver, kind, remarks)
    for name in registers.mode_pins:
        why = "sets the driver's microsteps or wakes it up, and no output of ours is fixed at a level: wire it"
        remarks.lost(f"{driver.path}.{name}", driver.line_of(name), why)
    if step is None or direction is None:
        if not driver.is_empty():
            facts.undriven.append(driver.path)
            remarks.lost(driver.path, driver.line, "has no step or no direction pin")
        return None
    facts.drivers.append(registers)
    wires = {
        "step": step.output(),
        "dir": {"pin": direction.name, "active": "high"},
        "inverted": direction.active == "low",
    }
    return {**wires, "enable": disable.output(inverted=True)} if disable else wires


def _compare_directions(facts: AxisFacts) -> None:
    """Motors of an axis that turn against each other differ in the board file, the axis as a whole in the profile."""
    inverted = [bool(motor.pop("inverted")) for motor in facts.motors]
    if not inverted:
        return
    if inverted[0]:
        facts.profile["invert_direction"] = True
    for motor, turned in zip(facts.motors[1:], inverted[1:], strict=True):
        motor["dir"]["active"] = "high" if turned == inverted[0] else "low"


def _compare_switches(facts: AxisFacts, part: Section, remarks: Remarks) -> None:
    """Of two motors only one has a switch, or each at another end: both stop at it, and here it is the first one's."""
    if len(facts.motors) != 2:
        return
    first, second = ({name for name in motor if name.startswith("limit")} for motor in facts.motors)
    opposite = {*first, *second} == {"limit_min", "limit_max"} and len(first) == len(second) == 1
    if bool(first) == bool(second) and not opposite:
        return
    for name in second:
        facts.motors[0][name] = facts.motors[1].pop(name)
    why = "one switch for both motors: homing squares the gantry by the difference of their pull-offs only"
    remarks.changed(part.path, part.line, why)


def shared_enable(axes: Section, remarks: Remarks) -> dict[str, Any] | None:
    """The enable of all drivers. FluidNC names the pin that switches them off."""
    pin = take_pin(axes, "shared_stepper_disable_pin", remarks)
    if axes.take("shared_stepper_reset_pin") is not None:
        why = "wakes the drivers up, and no output of ours is fixed at a level: wire it"
        remarks.lost("axes.shared_stepper_reset_pin", axes.line_of("shared_stepper_reset_pin"), why)
    return pin.output(inverted=True) if pin else None
