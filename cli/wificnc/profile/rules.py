"""Rules between the values of a machine profile. Each takes a profile of the right shape and names what clashes."""

from __future__ import annotations

from collections.abc import Iterator

from wificnc.files.problem import Finding
from wificnc.profile.model import LinearAxis, Machine
from wificnc.tables import AXES


def check(machine: Machine) -> list[Finding]:
    """Every contradiction in a profile."""
    return [finding for rule in RULES for finding in rule(machine)]


def has_axes(machine: Machine) -> Iterator[Finding]:
    if not any(machine.axis.present()):
        yield Finding("no-axis", ("axis",), "a machine has at least one axis", "add a table [axis.x]")


def soft_limits_need_homing(machine: Machine) -> Iterator[Finding]:
    if machine.limits.soft and not machine.homing.enabled:
        yield Finding(
            "soft-limits",
            ("limits", "soft"),
            "soft limits need homing: without it the controller does not know where the machine is",
            "set homing.enabled = true",
        )


def soft_limits_need_travel(machine: Machine) -> Iterator[Finding]:
    for index, axis in machine.axis.present():
        if machine.limits.soft and isinstance(axis, LinearAxis) and not axis.travel_mm:
            yield Finding(
                "soft-limits",
                ("axis", AXES[index].lower(), "travel_mm"),
                "soft limits need the travel of this axis",
                "measure it from end to end, in mm",
            )


def homing_order_is_of_its_axes(machine: Machine) -> Iterator[Finding]:
    present = {AXES[index] for index, _ in machine.axis.present()}
    homed = "".join(machine.homing.order or ())
    for letter in sorted(set(homed)):
        if letter not in present:
            yield Finding("homing-order", ("homing", "order"), f"names {letter}, which this machine does not have")
        elif homed.count(letter) > 1:
            yield Finding("homing-order", ("homing", "order"), f"names {letter} twice; an axis is homed once")


def second_motors_have_drivers_to_spare(machine: Machine) -> Iterator[Finding]:
    """The axis of the driver, and those after it, are gone."""
    taken: set[str] = set()
    for index, second in machine.second_motors():
        path = ("axis", AXES[index].lower(), "second", "driver")
        if second.driver is None:
            continue
        letter = second.driver.upper()
        if AXES.index(letter) < machine.axis_count:
            reason = f"is the driver of {letter}, which is an axis of this machine or comes before one"
            yield Finding("second-motor", path, reason, "name an axis after the machine's last one")
        elif letter in taken:
            yield Finding("second-motor", path, f"names {letter}, which is the second motor of another axis")
        taken.add(letter)


def pulses_fit(machine: Machine) -> Iterator[Finding]:
    """A step is a pulse and at least the same time of rest."""
    pulse_us = machine.stepper.step_pulse_us
    if not pulse_us:
        return
    fastest_hz = 1e6 / (2 * pulse_us)
    for index, axis in machine.axis.present():
        unit = "mm" if isinstance(axis, LinearAxis) else "deg"
        rate_hz = getattr(axis, f"steps_per_{unit}") * getattr(axis, f"max_rate_{unit}_min") / 60
        if rate_hz > fastest_hz:
            yield Finding(
                "step-rate",
                ("axis", AXES[index].lower(), f"max_rate_{unit}_min"),
                f"this is {rate_hz:.0f} steps/s, and pulses of {pulse_us} us allow {fastest_hz:.0f}",
                "a lower rate, less microstepping or a shorter stepper.step_pulse_us",
            )


def homing_slows_down(machine: Machine) -> Iterator[Finding]:
    feed, seek = machine.homing.feed_mm_min, machine.homing.seek_mm_min
    if feed is not None and seek is not None and feed > seek:
        yield Finding(
            "homing-speeds",
            ("homing", "feed_mm_min"),
            f"the slow approach ({feed:g} mm/min) is faster than the search ({seek:g} mm/min)",
        )


def pull_off_fits(machine: Machine) -> Iterator[Finding]:
    travels = [travel for travel in machine.travel_mm[:3] if travel]
    pull_off = machine.homing.pull_off_mm or 0
    if travels and pull_off >= min(travels):
        yield Finding(
            "pull-off",
            ("homing", "pull_off_mm"),
            f"backs off {pull_off:g} mm, but an axis has only {min(travels):g} mm of travel",
        )
    for index, second in machine.second_motors():
        travel, own = machine.travel_mm[index], second.pull_off_mm
        if travel and own and own >= travel:
            yield Finding(
                "pull-off",
                ("axis", AXES[index].lower(), "second", "pull_off_mm"),
                f"backs off {own:g} mm, but the axis has only {travel:g} mm of travel",
            )


def pwm_range(machine: Machine) -> Iterator[Finding]:
    low, high = machine.spindle.pwm_min_pct, machine.spindle.pwm_max_pct
    if low is not None and high is not None and low > high - 1:
        yield Finding("pwm-range", ("spindle", "pwm_min_pct"), f"must be at least 1 % below pwm_max_pct ({high:g})")


def spindle_range(machine: Machine) -> Iterator[Finding]:
    low, high = machine.spindle.min_rpm, machine.spindle.max_rpm
    if low is not None and high is not None and low >= high:
        yield Finding("spindle-range", ("spindle", "min_rpm"), f"must be below max_rpm ({high:g})")


def arms_are_scara(machine: Machine) -> Iterator[Finding]:
    kinematics = machine.kinematics
    for key in ("arm_1_mm", "arm_2_mm"):
        given = getattr(kinematics, key) is not None
        if kinematics.type == "scara" and not given:
            yield Finding(
                "arms", ("kinematics", key), "two arms need their lengths", "measure from joint to joint, in mm"
            )
        elif kinematics.type != "scara" and given:
            yield Finding("arms", ("kinematics", key), "arms are for a two-arm machine only", 'type = "scara"')


def belts_are_alike(machine: Machine) -> Iterator[Finding]:
    x, y = machine.axis.x, machine.axis.y
    if machine.kinematics.type != "corexy":
        return
    if x is None or y is None:
        yield Finding("corexy", ("kinematics", "type"), "CoreXY needs both X and Y", "write [axis.x] and [axis.y]")
    elif x.steps_per_mm != y.steps_per_mm:
        given = f"X has {x.steps_per_mm:g} and Y {y.steps_per_mm:g}"
        message = f"X and Y of a CoreXY need the same steps/mm, but {given}"
        yield Finding("corexy", ("axis", "y", "steps_per_mm"), message, "set both to the same value")


RULES = (
    arms_are_scara,
    belts_are_alike,
    has_axes,
    soft_limits_need_homing,
    soft_limits_need_travel,
    pulses_fit,
    homing_slows_down,
    pull_off_fits,
    homing_order_is_of_its_axes,
    second_motors_have_drivers_to_spare,
    spindle_range,
    pwm_range,
)
