"""The model of a machine profile. Ranges and help come from protocol/settings.toml; this file says only what a
profile calls a setting, and where it is.

A key that a profile leaves out leaves the controller's setting as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from wificnc.files.values import Text, WholeChoice
from wificnc.tables import AXES, load_settings

Value = bool | int | float

ROUNDING = 1e-6  # what a value may lose in its text
SIGNIFICANT_DIGITS = 8  # what Grbl's number reader keeps


def of(setting: str) -> Any:
    """Marks a field as one of the controller's settings; its range is the setting's."""
    row = load_settings()[setting]
    low, high = (None, None) if row.type == "bool" else (row.min, row.max)
    return Field(ge=low, le=high, description=row.help, json_schema_extra={"setting": row.name})


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    def assigned(self) -> Iterator[tuple[str, Value]]:
        """Settings that this table gives a value: name, value."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if isinstance(field.json_schema_extra, dict) and value is not None:
                yield str(field.json_schema_extra["setting"]), value


class Second(_Table):
    """[axis.y.second]: the motor at the other side of a gantry."""

    driver: Literal["y", "z", "a", "b", "c"] | None = None  # an axis that the machine lacks; None: as the board has it
    own_switch: bool | None = None  # False: both motors stop at the first one's
    invert_direction: bool | None = None  # against the first one
    pull_off_mm: Annotated[float | None, of("second_pull_off_mm")] = None


class _Axis(_Table):
    second: Second | None = None
    invert_direction: bool | None = None
    invert_step: bool | None = None
    home_at: Literal["min", "max"] | None = None
    driver_current_ma: Annotated[int | None, of("driver_current_ma")] = None
    driver_microsteps: Annotated[int | None, of("driver_microsteps")] = None
    driver_hold_pct: Annotated[int | None, of("driver_hold_pct")] = None
    driver_stealth_mm_min: Annotated[int | None, of("driver_stealth_mm_min")] = None
    driver_coolstep: Annotated[int | None, of("driver_coolstep")] = None
    driver_stall: Annotated[int | None, of("driver_stall")] = None
    driver_stall_mm_min: Annotated[int | None, of("driver_stall_mm_min")] = None


class LinearAxis(_Axis):
    """[axis.x] [axis.y] [axis.z]"""

    steps_per_mm: Annotated[float, of("steps_per_mm")]
    max_rate_mm_min: Annotated[float, of("max_rate_mm_min")]
    acceleration_mm_s2: Annotated[float, of("acceleration_mm_s2")]
    travel_mm: Annotated[float | None, of("max_travel_mm")] = None


class RotaryAxis(_Axis):
    """[axis.a] [axis.b] [axis.c]: turn about X, Y, Z. The controller counts degrees as it counts mm elsewhere."""

    steps_per_deg: Annotated[float, of("steps_per_mm")]
    max_rate_deg_min: Annotated[float, of("max_rate_mm_min")]
    acceleration_deg_s2: Annotated[float, of("acceleration_mm_s2")]
    travel_deg: Annotated[float, of("max_travel_mm")] = 0.0  # endless


# mask setting -> an axis's bit in it; None = the profile does not say
MASKS: dict[str, Callable[[_Axis], bool | None]] = {
    "dir_invert_mask": lambda axis: axis.invert_direction,
    "step_invert_mask": lambda axis: axis.invert_step,
    "homing_dir_mask": lambda axis: None if axis.home_at is None else axis.home_at == "min",
    "second_dir_invert_mask": lambda axis: axis.second.invert_direction if axis.second else None,
    "one_switch_mask": lambda axis: (
        None if axis.second is None or axis.second.own_switch is None else not axis.second.own_switch
    ),
}


HOMING_ORDER = ("Z", "XY", "A", "B", "C", "")  # of the cycles, as Grbl: the tool goes up first
Cycle = Annotated[str, Field(pattern=f"^[{AXES}]+$")]


class Axes(_Table):
    x: LinearAxis | None = None
    y: LinearAxis | None = None
    z: LinearAxis | None = None
    a: RotaryAxis | None = None
    b: RotaryAxis | None = None
    c: RotaryAxis | None = None

    def present(self) -> Iterator[tuple[int, LinearAxis | RotaryAxis]]:
        """Axes that the machine has: index, axis."""
        for index, letter in enumerate(AXES.lower()):
            axis = getattr(self, letter)
            if axis is not None:
                yield index, axis


KINDS = load_settings()["kinematics"].choice
KINEMATICS = tuple(kind.name for kind in KINDS)  # in the order of the setting's values
# X and Y of the tool are not those of the joints, and their travel is not a rectangle.
CURVED = tuple(kind.name for kind in KINDS if kind.curved)


class Kinematics(_Table):
    type: Literal[KINEMATICS] | None = None  # type: ignore[valid-type]
    arm_1_mm: Annotated[float | None, of("arm_1_mm")] = None
    arm_2_mm: Annotated[float | None, of("arm_2_mm")] = None


class Motion(_Table):
    junction_deviation_mm: Annotated[float | None, of("junction_deviation_mm")] = None
    arc_tolerance_mm: Annotated[float | None, of("arc_tolerance_mm")] = None
    arc_radius_tolerance_mm: Annotated[float | None, of("arc_radius_tolerance_mm")] = None
    jerk_mm_s3: Annotated[float | None, of("jerk_mm_s3")] = None


class Stepper(_Table):
    step_pulse_us: Annotated[int | None, of("step_pulse_us")] = None
    idle_delay_ms: Annotated[int | None, of("idle_delay_ms")] = None
    enable_active_high: Annotated[bool | None, of("enable_invert")] = None


class Limits(_Table):
    soft: Annotated[bool | None, of("soft_limits")] = None
    hard: Annotated[bool | None, of("hard_limits")] = None
    active_high: Annotated[bool | None, of("limit_invert")] = None


class Homing(_Table):
    enabled: Annotated[bool | None, of("homing")] = None
    feed_mm_min: Annotated[float | None, of("homing_feed_mm_min")] = None
    seek_mm_min: Annotated[float | None, of("homing_seek_mm_min")] = None
    debounce_ms: Annotated[int | None, of("homing_debounce_ms")] = None
    pull_off_mm: Annotated[float | None, of("homing_pull_off_mm")] = None
    # axes of each cycle, such as ["Z", "XY"]; an axis that is in none has no switch
    order: Annotated[tuple[Cycle, ...] | None, Field(strict=False, max_length=len(HOMING_ORDER))] = None


class Probe(_Table):
    active_high: Annotated[bool | None, of("probe_invert")] = None


class Spindle(_Table):
    """`type` 0 is the board's own output, others are drives on RS-485 (docs/spindles.md); registers and commands are
    for type 1."""

    type: Annotated[int | None, of("spindle_type")] = None
    max_rpm: Annotated[float | None, of("spindle_max_rpm")] = None
    min_rpm: Annotated[float | None, of("spindle_min_rpm")] = None
    laser: Annotated[bool | None, of("laser_mode")] = None
    encoder_counts: Annotated[int | None, of("encoder_counts")] = None
    pwm_hz: Annotated[int | None, of("pwm_hz")] = None
    pwm_min_pct: Annotated[float | None, of("pwm_min_pct")] = None
    pwm_max_pct: Annotated[float | None, of("pwm_max_pct")] = None
    on_delay_s: Annotated[float | None, of("spindle_on_delay_s")] = None
    off_delay_s: Annotated[float | None, of("spindle_off_delay_s")] = None
    at_speed_pct: Annotated[int | None, of("at_speed_pct")] = None
    vfd_address: Annotated[int | None, of("vfd_address")] = None
    vfd_rpm_per_hz: Annotated[int | None, of("vfd_rpm_per_hz")] = None
    vfd_baud: Annotated[int | None, of("vfd_baud")] = None
    vfd_parity: Annotated[int | None, of("vfd_parity")] = None
    vfd_timeout_ms: Annotated[int | None, of("vfd_timeout_ms")] = None
    vfd_run_register: Annotated[int | None, of("vfd_run_register")] = None
    vfd_set_register: Annotated[int | None, of("vfd_set_register")] = None
    vfd_read_register: Annotated[int | None, of("vfd_read_register")] = None
    vfd_clockwise: Annotated[int | None, of("vfd_clockwise")] = None
    vfd_counter_clockwise: Annotated[int | None, of("vfd_counter_clockwise")] = None
    vfd_stop: Annotated[int | None, of("vfd_stop")] = None
    vfd_set_multiplier: Annotated[float | None, of("vfd_set_multiplier")] = None
    vfd_set_divider: Annotated[float | None, of("vfd_set_divider")] = None
    vfd_read_multiplier: Annotated[float | None, of("vfd_read_multiplier")] = None
    vfd_read_divider: Annotated[float | None, of("vfd_read_divider")] = None


class Coolant(_Table):
    delay_s: Annotated[float | None, of("coolant_delay_s")] = None


class Machine(_Table):
    """A machine profile. What it reports ($10, $13) is the user's taste, not the machine's: no keys for it."""

    schema_: Annotated[Literal[1], WholeChoice, Field(alias="schema")]
    name: Text
    axis: Axes
    kinematics: Kinematics = Kinematics()
    motion: Motion = Motion()
    stepper: Stepper = Stepper()
    limits: Limits = Limits()
    homing: Homing = Homing()
    probe: Probe = Probe()
    spindle: Spindle = Spindle()
    coolant: Coolant = Coolant()

    @property
    def axis_count(self) -> int:
        """Axes that the controller must have, in the order XYZABC: 4 for a machine of X, Z and A."""
        return 1 + max(index for index, _ in self.axis.present())

    def second_motors(self) -> Iterator[tuple[int, Second]]:
        """Axes with a table for their second motor: index, table."""
        for index, axis in self.axis.present():
            if axis.second is not None:
                yield index, axis.second

    @property
    def travel_mm(self) -> tuple[float | None, ...]:
        """Travel of the tool in X .. C (degrees of A B C); None = no such axis, not known, endless, or not straight."""
        travels: list[float | None] = [None] * len(AXES)
        for index, axis in self.axis.present():
            if index < 2 and self.kinematics.type in CURVED:
                continue
            travels[index] = (axis.travel_mm if isinstance(axis, LinearAxis) else axis.travel_deg) or None
        return tuple(travels)

    def settings(self) -> dict[int, Value]:
        """Number -> value of every setting that this profile gives."""
        table = load_settings()
        values: dict[int, Value] = {}
        if self.kinematics.type is not None:
            values[table["kinematics"].number] = KINEMATICS.index(self.kinematics.type)
        values[table["machine_axes"].number] = self.axis_count
        for part in self._parts():
            values.update((table[name].number, value) for name, value in part.assigned())
        for index, axis in self.axis.present():
            values.update((table[name].number + index, value) for name, value in axis.assigned())
        values.update(self._second_motors())
        for name, bit_of in MASKS.items():
            bits = {index: bit_of(axis) for index, axis in self.axis.present()}
            if any(bit is not None for bit in bits.values()):
                values[table[name].number] = sum(1 << index for index, bit in bits.items() if bit)
        if self.homing != Homing():
            cycles = self._homing_cycles()
            values.update((table[f"homing_cycle_{cycle}_mask"].number, mask) for cycle, mask in cycles)
        return values

    def _parts(self) -> tuple[_Table, ...]:
        motion = (self.kinematics, self.stepper, self.motion, self.limits, self.homing, self.probe)
        return (*motion, self.spindle, self.coolant)

    def _second_motors(self) -> Iterator[tuple[int, Value]]:
        table = load_settings()
        for index, second in self.second_motors():
            yield from ((table[name].number + index, value) for name, value in second.assigned())
        drivers = {index: second.driver for index, second in self.second_motors() if second.driver}
        for index, _ in self.axis.present():
            if drivers:
                letter = drivers.get(index)
                yield table["second_motor"].number + index, AXES.index(letter.upper()) + 1 if letter else 0

    def _homing_cycles(self) -> Iterator[tuple[int, int]]:
        """What `$H` seeks, and in which order: axes that the machine does not have are in no cycle. Without an order, a
        rotary axis has a switch only where the profile says at which end."""
        homed = {AXES[index] for index, axis in self.axis.present() if isinstance(axis, LinearAxis) or axis.home_at}
        order: tuple[str, ...] = HOMING_ORDER
        if self.homing.order is not None:
            homed = set(AXES)
            order = (*self.homing.order, *[""] * (len(HOMING_ORDER) - len(self.homing.order)))
        for cycle, letters in enumerate(order, start=1):
            yield cycle, sum(1 << AXES.index(letter) for letter in letters if letter in homed)

    def settings_lines(self) -> list[str]:
        """The lines that bring a controller to this profile, in an order it accepts: homing before soft limits, and a
        driver is given up before another axis gets it."""
        homing, second = (load_settings()[name].number for name in ("homing", "second_motor"))
        given_up = {(second + index, 0) for index in range(len(AXES))}
        values = sorted(self.settings().items(), key=lambda item: (item[0] != homing, item not in given_up, item[0]))
        return [f"${number}={_text(value)}" for number, value in values]

    def settings_texts(self) -> dict[int, str]:
        """Number -> value as the controller reads it, of every setting that this profile gives."""
        return {number: _text(value) for number, value in self.settings().items()}


def _text(value: Value) -> str:
    """A value as the controller reads it: three decimals, more when they are needed, never an exponent."""
    if not isinstance(value, float):
        return str(int(value))
    usual = f"{value:.3f}"
    if float(usual) == value:
        return usual
    decimals = max(SIGNIFICANT_DIGITS - len(str(int(value))), 3)
    text = f"{value:.{decimals}f}"
    return text if math.isclose(float(text), value, rel_tol=ROUNDING) else f"{value:.{decimals + 3}f}"
