"""A mass on a spring and a damper that an axis carries: its vibration, exactly. Needs numpy.

y is where the mass is relative to its axis; u is the axis' position:

    y'' + 2 z w y' + w^2 y = -u''

With z = y' - conj(l) y and l = -z w + i w sqrt(1 - z^2) that is z' = l z - u'', and y = Im(z) / Im(l). Where u is made
of straight lines, u'' is an impulse at each corner, the change of speed dv: z jumps by -dv there, and turns and decays
by exp(l t) in between. No step of an integration, no error of one.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wificnc.tune.choice import Mode
from wificnc.tune.motion import AxisMotion, Floats
from wificnc.tune.shapers import Impulses

SAMPLES_PER_PERIOD = 40
SAMPLE_MAX_S = 5e-4
CHUNK = 1 << 18  # samples at a time: bounds the memory of a long job
DECAY_MAX = 8.0  # of a block of the recursion, as an exponent: sums keep 12 of 16 digits
AFTER_S = 1.0  # that the mass is watched after the end of the job
SECOND_S = 0.01  # over which constant speed is recognised
STILL = 0.05  # of the axis' acceleration: less is constant speed


@dataclass(frozen=True)
class Vibration:
    """What a mass did, um. rest: while the axis rests; moving: while its speed is constant. nan: never."""

    rest_rms_um: float
    rest_max_um: float
    moving_rms_um: float
    moving_max_um: float
    worst_s: float  # when the axis rests and the mass is farthest from it; nan: never


@dataclass
class _Sum:
    count: int = 0
    squares: float = 0.0
    most: float = math.nan
    when_s: float = math.nan

    def add(self, t_s: Floats, y_mm: Floats) -> None:
        if not y_mm.size:
            return
        self.count += y_mm.size
        self.squares += float(y_mm @ y_mm)
        index = int(np.argmax(np.abs(y_mm)))
        if not abs(y_mm[index]) * 1e3 <= self.most:
            self.most, self.when_s = float(abs(y_mm[index]) * 1e3), float(t_s[index])

    @property
    def rms_um(self) -> float:
        return math.sqrt(self.squares / self.count) * 1e3 if self.count else math.nan


def sample_s(mode: Mode) -> float:
    """The time between two samples."""
    return min(1.0 / (mode.hz * SAMPLES_PER_PERIOD), SAMPLE_MAX_S)


def vibrations(
    motion: AxisMotion, shape: Impulses, modes: Sequence[Mode], acceleration_mm_s2: float
) -> tuple[Vibration, ...]:
    """Drive masses with the shaped axis. acceleration_mm_s2: the limit of the axis."""
    sums = [(_Sum(), _Sum()) for _ in modes]
    states = [0j for _ in modes]
    step = min(sample_s(mode) for mode in modes)
    first = motion.t_s[0]
    count = int((motion.t_s[-1] - first + shape.duration_s + AFTER_S) / step) + 2
    around = max(2, round(SECOND_S / step))
    for begin in range(0, count, CHUNK):
        length = min(CHUNK, count - begin)
        u_mm = motion.at(first + step * np.arange(begin - around, begin + length + around), shape)
        t_s = first + step * np.arange(begin, begin + length)
        resting = motion.rests(t_s, shape)
        constant = _constant_speed(u_mm, around, step, acceleration_mm_s2) & ~resting
        for index, mode in enumerate(modes):
            y_mm, states[index] = _respond(u_mm[around - 1 : around + length + 1], step, mode, states[index])
            sums[index][0].add(t_s[resting], y_mm[resting])
            sums[index][1].add(t_s[constant], y_mm[constant])
    return tuple(Vibration(rest.rms_um, rest.most, moving.rms_um, moving.most, rest.when_s) for rest, moving in sums)


def response_mm(motion: AxisMotion, shape: Impulses, mode: Mode, t_s: Floats) -> Floats:
    """y at these evenly spaced times, of a mass that was at rest before the first one."""
    step = float(t_s[1] - t_s[0])
    around = np.concatenate(([t_s[0] - step], t_s, [t_s[-1] + step]))
    return _respond(motion.at(around, shape), step, mode, 0j)[0]


def _respond(u_mm: Floats, step: float, mode: Mode, state: complex) -> tuple[Floats, complex]:
    """y where u is given but for its first and last sample, and z at the end. state: z before."""
    jumps = np.diff(u_mm, n=2) / step
    omega = 2.0 * math.pi * mode.hz
    pole = complex(-mode.damping * omega, omega * math.sqrt(1.0 - mode.damping**2))
    z = _recursion(cmath.exp(pole * step), -jumps, state)
    return z.imag / pole.imag, complex(z[-1])


def _recursion(turn: complex, inputs: Floats, state: complex) -> NDArray[np.complex128]:
    """z[k] = turn z[k - 1] + inputs[k], from z[-1] = state: sums in blocks, whose decay is taken out."""
    decay = -math.log(abs(turn))
    length = max(1, min(len(inputs), int(DECAY_MAX / decay) if decay > 0.0 else len(inputs), 4096))
    padded: Any = np.zeros(-(-len(inputs) // length) * length)
    padded[: len(inputs)] = inputs
    powers = turn ** np.arange(1, length + 1)
    sums = np.cumsum(padded.reshape(-1, length) / powers, axis=1)
    z = np.empty_like(sums)
    for index, block in enumerate(sums):
        z[index] = powers * (state + block)
        state = z[index, -1]
    flat: NDArray[np.complex128] = z.reshape(-1)[: len(inputs)]
    return flat


def _constant_speed(u_mm: Floats, around: int, step: float, acceleration_mm_s2: float) -> NDArray[np.bool_]:
    """Where the shaped axis moves at a constant speed: no acceleration within SECOND_S and half of it, for as long.

    `around` more samples of u come before and after.
    """
    length = len(u_mm) - 2 * around
    here = u_mm[around : around + length]
    still = np.ones(length, dtype=bool)
    for shift in (around, around // 2):
        ahead, behind = (u_mm[around + move : around + move + length] for move in (shift, -shift))
        still &= np.abs(ahead - 2.0 * here + behind) < STILL * acceleration_mm_s2 * (shift * step) ** 2
        still &= ahead != behind
    # In the middle of a ramp up and down the differences cancel for an instant.
    margin = around // 2
    changes = np.concatenate(([0], np.cumsum(~still)))
    index = np.arange(length)
    low, high = np.maximum(index - margin, 0), np.minimum(index + margin + 1, length)
    quiet: NDArray[np.bool_] = changes[high] == changes[low]
    return quiet
