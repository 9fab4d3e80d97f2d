"""Frequency and damping of a vibration from the waves that it drew. Pure Python."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wificnc.errors import UserError
from wificnc.tables import load_settings
from wificnc.tune.choice import Mode, check_mode


@dataclass(frozen=True)
class Waves:
    """What was measured next to a line."""

    feed_mm_min: float
    waves: float
    distance_mm: float
    first: float | None = None  # heights of two waves, in any one unit
    last: float | None = None
    between: float | None = None  # waves from the first height to the last one; None: all


def counted_hz(waves: Waves) -> float:
    """N waves in D mm at F mm/s: N F / D. Raises UserError."""
    for name, value in (("feed", waves.feed_mm_min), ("waves", waves.waves), ("distance", waves.distance_mm)):
        if not (math.isfinite(value) and value > 0.0):
            raise UserError(f"--{name} {value:g}: must be more than 0")
    return waves.waves * waves.feed_mm_min / 60.0 / waves.distance_mm


def decrement_damping(first: float, last: float, between: float) -> float:
    """The damping ratio of a vibration of which `between` waves lie between two heights.

    The logarithmic decrement of one wave is d = ln(first / last) / between = 2 pi z / sqrt(1 - z^2).

    Raises:
        UserError: the heights are not those of a vibration that ends.
    """
    for name, value in (("first", first), ("last", last), ("between", between)):
        if not (math.isfinite(value) and value > 0.0):
            raise UserError(f"--{name} {value:g}: must be more than 0")
    if last > first:
        raise UserError(
            f"the last wave ({last:g}) is higher than the first one ({first:g})",
            hint="measure away from the corner: the waves become smaller",
        )
    decrement = math.log(first / last) / between
    return decrement / math.hypot(2.0 * math.pi, decrement)


def measured_mode(waves: Waves) -> Mode:
    """The vibration that drew the waves; without heights it has the default damping. Raises UserError."""
    damped_hz = counted_hz(waves)
    if (waves.first is None) != (waves.last is None):
        raise UserError("damping needs two heights", hint="give --first and --last, or neither")
    if waves.first is None or waves.last is None:
        if waves.between is not None:
            raise UserError("--between has no heights", hint="give --first and --last, too")
        damping = float(load_settings()["shaper_damping"].default)
    else:
        damping = decrement_damping(waves.first, waves.last, waves.between or waves.waves)
    return check_mode(damped_hz / math.sqrt(1.0 - damping**2), damping)
