"""Which shaper for a frequency and a damping ratio: the table of all, the recommended one, and its settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from wificnc.errors import UserError
from wificnc.tables import AXES, load_settings
from wificnc.tune.shapers import OFF, SHAPERS, TWO_HUMP_EI, Shaper, impulses

SPREAD = 0.10  # by which a frequency changes with the place on the table, the load, and the measurement
GOOD = 0.12  # of the vibration may be left within the spread: ZV has it to 7 %, MZV to 11 %, EI to 26 %
ACCELERATION_MM_S2 = 500.0  # for the rounding, where the machine is not known


@dataclass(frozen=True)
class Mode:
    """A vibration of an axis."""

    hz: float  # without damping
    damping: float


@dataclass(frozen=True)
class Row:
    """What one shaper does to a vibration."""

    shaper: Shaper
    residual: float  # at the frequency; 0 .. 1
    residual_low: float  # at (1 - spread) of it
    residual_high: float  # at (1 + spread) of it
    delay_s: float
    duration_s: float
    rounding_mm: float

    @property
    def worst(self) -> float:
        return max(self.residual, self.residual_low, self.residual_high)

    def json(self) -> dict[str, Any]:
        return {**asdict(self), "shaper": self.shaper.name, "value": self.shaper.value}


def check_mode(hz: float, damping: float) -> Mode:
    """A vibration that the settings can hold. Raises UserError."""
    table = load_settings()
    low, high = table["shaper_hz"].min, table["shaper_hz"].max
    if not low <= hz <= high:
        raise UserError(
            f"a vibration of {hz:.4g} Hz: the shapers take {low:g} to {high:g} Hz",
            hint="check the units: feed in mm/min, distance in mm, time in s",
        )
    least, most = table["shaper_damping"].min, table["shaper_damping"].max
    if not least <= damping <= most:
        raise UserError(
            f"a damping ratio of {damping:.3g}: the shapers take {least:g} to {most:g}",
            hint="0.02 to 0.1 is usual; a vibration with more damping ends after a wave and needs no shaper",
        )
    return Mode(hz, damping)


def rows(mode: Mode, spread: float = SPREAD, acceleration_mm_s2: float = ACCELERATION_MM_S2) -> tuple[Row, ...]:
    """All shapers, set to this vibration."""
    found = []
    for shaper in SHAPERS:
        shape = impulses(shaper, mode.hz, mode.damping)
        here, low, high = (
            shape.residual(mode.hz * factor, mode.damping) for factor in (1.0, 1.0 - spread, 1.0 + spread)
        )
        rounding_mm = shape.rounding_mm(acceleration_mm_s2)
        found.append(Row(shaper, here, low, high, shape.delay_s, shape.duration_s, rounding_mm))
    return tuple(found)


def recommended(table: Sequence[Row]) -> Shaper:
    """The shortest shaper that is good within the spread; the widest when no shaper is."""
    shapers = [row for row in table if row.shaper is not OFF]
    return next((row.shaper for row in shapers if row.worst <= GOOD), TWO_HUMP_EI)


def assignments(axis: str, shaper: Shaper, mode: Mode | None) -> dict[int, str]:
    """$ number -> value as the controller prints it. Without a mode only the shaper itself."""
    table, index = load_settings(), AXES.index(axis.upper())
    values: dict[str, float] = {"shaper": shaper.value}
    if mode is not None:
        values |= {"shaper_hz": mode.hz, "shaper_damping": mode.damping}
    return {table[name].number + index: table[name].text(value) for name, value in values.items()}


def settings_line(values: dict[int, str]) -> str:
    """$170=1 $180=41.30 $190=0.020"""
    return " ".join(f"${number}={value}" for number, value in values.items())
