"""The input shapers: impulses, what vibration they leave, what they cost. Pure Python.

A shaper replaces the commanded position u(t) of an axis by sum(w_i u(t - t_i)): copies of the motion, each a part of
it, so late that their vibrations cancel. Singer and Seering, "Preshaping command inputs to reduce system vibration"
(1990); EI and two-hump EI: Singhose, Seering and Singer (1994, 1996); MZV is the zero-vibration shaper with three
impulses that are 3/8 of a period apart.

    f    frequency of the vibration without damping, Hz; the setting $180
    z    damping ratio; the setting $190
    w    2 pi f, rad/s
    Td   period of the damped vibration, 1 / (f sqrt(1 - z^2)), s
    K    what half a period leaves of the amplitude, exp(-z pi / sqrt(1 - z^2))
    V    what the vibration keeps by a shaper: 0 = nothing, 1 = all
    v    V of EI and two-hump EI at f: 0.05
"""

from __future__ import annotations

import math
from dataclasses import dataclass

TOLERATED = 0.05  # v


@dataclass(frozen=True)
class Impulses:
    """A shaper for one frequency: the weights add up to 1, the first time is 0."""

    weights: tuple[float, ...]
    times_s: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """From the end of the program's motion to the end of the axis' motion."""
        return self.times_s[-1]

    @property
    def delay_s(self) -> float:
        """By which the axis is late on its way, at constant speed."""
        return sum(w * t for w, t in zip(self.weights, self.times_s, strict=True))

    def rounding_mm(self, acceleration_mm_s2: float) -> float:
        """The deviation in a curve with this acceleration, a sum(w (t - mean)^2) / 2."""
        mean = self.delay_s
        spread = sum(w * (t - mean) ** 2 for w, t in zip(self.weights, self.times_s, strict=True))
        return acceleration_mm_s2 * spread / 2.0

    def residual(self, hz: float, damping: float) -> float:
        """V of a vibration with this frequency and damping."""
        omega = 2.0 * math.pi * hz
        damped = omega * math.sqrt(1.0 - damping**2)
        late = self.times_s[-1]
        c = s = 0.0
        for weight, time in zip(self.weights, self.times_s, strict=True):
            grown = weight * math.exp(damping * omega * (time - late))
            c += grown * math.cos(damped * time)
            s += grown * math.sin(damped * time)
        return math.hypot(c, s)


@dataclass(frozen=True)
class Shaper:
    """One value of the setting `shaper`."""

    value: int
    name: str
    words: str


OFF = Shaper(0, "off", "no shaper")
ZV = Shaper(1, "ZV", "shortest; needs the exact frequency")
MZV = Shaper(2, "MZV", "for a frequency within 10 %")
EI = Shaper(3, "EI", "for a frequency within 25 %")
TWO_HUMP_EI = Shaper(4, "2-hump EI", "for a frequency within 35 %, or two close ones")
SHAPERS = (OFF, ZV, MZV, EI, TWO_HUMP_EI)


def impulses(shaper: Shaper, hz: float, damping: float) -> Impulses:
    """The impulses of a shaper for this frequency and damping ratio (0 <= damping < 1)."""
    period = 1.0 / (hz * math.sqrt(1.0 - damping**2))
    k = math.exp(-damping * math.pi / math.sqrt(1.0 - damping**2))
    if shaper is OFF:
        return Impulses((1.0,), (0.0,))
    raw, parts = {ZV: _zv, MZV: _mzv, EI: _ei, TWO_HUMP_EI: _two_hump_ei}[shaper](k)
    total = sum(raw)
    return Impulses(tuple(weight / total for weight in raw), tuple(part * period for part in parts))


def _zv(k: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Weights before they are normalised, and times in periods; so do the next three."""
    return (1.0, k), (0.0, 0.5)


def _mzv(k: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    k = k**0.75
    outer = 1.0 - 1.0 / math.sqrt(2.0)
    return (outer, (math.sqrt(2.0) - 1.0) * k, outer * k**2), (0.0, 0.375, 0.75)


def _ei(k: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    outer, middle = (1.0 + TOLERATED) / 4.0, (1.0 - TOLERATED) / 2.0
    return (outer, middle * k, outer * k**2), (0.0, 0.5, 1.0)


def _two_hump_ei(k: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    v2 = TOLERATED**2
    x = (v2 * (math.sqrt(1.0 - v2) + 1.0)) ** (1.0 / 3.0)
    outer = (3.0 * x**2 + 2.0 * x + 3.0 * v2) / (16.0 * x)
    return (outer, (0.5 - outer) * k, (0.5 - outer) * k**2, outer * k**3), (0.0, 0.5, 1.0, 1.5)
