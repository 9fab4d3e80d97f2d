"""How fast a path can be at best: the reference that job times are compared with.

The programmed path is smoothed inside a tube of radius `tolerance_mm` (least sum of squared second differences, every
sample within the tube), then timed by a backward and a forward pass over the samples: the time-optimal
parametrisation of Bobrow, Dubowsky, Gibson (1985) in the form of controllable sets (Pham, Pham 2018), with the speed
and acceleration limit of every axis and the feed. No jerk limit. What comes out can be travelled, but another path in
the tube may be faster: a reference, not a bound.

Smoothing: x = q + d minimises |S(q + d)|^2 with |d_i| <= r_i, by the alternating direction method of multipliers. S is
the second difference with fixed ends, which sines diagonalise, so the linear solve is a sine transform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.program import Floats, Programmed

STEP_MM = 0.005
MAX_SAMPLES = 400_000  # longer paths get longer steps
WEIGHTS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)  # of the constraint: long waves first
ITERATIONS = 50  # with each weight

Singles = NDArray[np.float32]


@dataclass(frozen=True)
class Samples:
    """The path at equal steps of each stretch between two rests."""

    at_mm: Floats  # (n, 3)
    step_mm: Floats  # (n - 1,)
    feed_mm_s: Floats  # (n,)
    rests: NDArray[np.bool_]  # (n,)


def optimal_time_s(program: Programmed, tolerance_mm: float, rate_mm_s: float, accel_mm_s2: float) -> float:
    """Seconds, at rest at both ends and wherever the program rests; dwells not counted."""
    samples = sample(program)
    radius = np.where(samples.rests, 0.0, tolerance_mm)
    path = smooth(samples.at_mm, radius)
    return travel_time_s(path, samples, rate_mm_s, accel_mm_s2)


def sample(program: Programmed) -> Samples:
    """Samples at all rests, and between them at steps as equal as they can be."""
    length = np.linalg.norm(np.diff(program.points_mm, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(length)])
    step = max(STEP_MM, s[-1] / MAX_SAMPLES)
    bounds = s[program.rests]
    counts = np.maximum(2, np.ceil(np.diff(bounds) / step)).astype(int)
    counts[np.argmax(counts)] += _easy(int(counts.sum())) - int(counts.sum())
    grid = np.concatenate(
        [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(bounds[:-1], bounds[1:], counts, strict=True)] + [bounds[-1:]]
    )
    at = np.stack([np.interp(grid, s, program.points_mm[:, axis]) for axis in range(3)], axis=1)
    last = len(length) - 1
    before = np.clip(np.searchsorted(s, grid - step, side="right") - 1, 0, last)
    after = np.clip(np.searchsorted(s, grid + step, side="left") - 1, 0, last)
    feed = np.minimum(program.feed_mm_s[before], program.feed_mm_s[after])
    rests = np.zeros(len(grid), bool)
    rests[np.concatenate([[0], np.cumsum(counts)])] = True
    return Samples(at, np.diff(grid), feed, rests)


def _easy(count: int) -> int:
    """The next number that Fourier transforms like: no prime factor above 5."""
    easy = [int(2**a * 3**b * 5**c) for a in range(24) for b in range(14) for c in range(10)]
    return min(n for n in easy if n >= count)


def smooth(q: Floats, radius: Floats) -> Floats:
    """The smoothest path with every sample within its radius."""
    n = len(q) - 1
    bend = np.zeros_like(q)
    bend[1:-1] = np.diff(q, n=2, axis=0)
    pull = np.zeros_like(q)
    pull[1:-1] = np.diff(bend, n=2, axis=0)
    pull_f = pull.astype(np.float32)
    stiffness = (2.0 - 2.0 * np.cos(np.pi * np.arange(1, n) / n)) ** 2
    limit = radius.astype(np.float32)[:, None]
    z = np.zeros_like(pull_f)
    u = np.zeros_like(pull_f)
    last = WEIGHTS[0]
    for weight in WEIGHTS:
        u *= np.float32(last / weight)
        last = weight
        gain = (1.0 / (stiffness + weight)).astype(np.float32)
        for _ in range(ITERATIONS):
            d = _solve(np.float32(weight) * (z - u) - pull_f, gain)
            w = d + u
            far = np.sqrt(np.einsum("ij,ij->i", w, w))[:, None]
            z = w * np.minimum(1.0, limit / np.maximum(far, np.float32(1e-20)))
            u = w - z
    result: Floats = q + z
    return result


def _solve(right: Singles, gain: Singles) -> Singles:
    """(S'S + weight)^-1 right, 0 at both ends: sine transform, gain, and back."""
    n = len(right) - 1
    out = np.zeros_like(right)
    for axis in range(right.shape[1]):
        if not right[:, axis].any():
            continue
        once = _sines(right[1:-1, axis], n)
        out[1:-1, axis] = _sines(once * gain, n) * np.float32(0.5 / n)
    return out


def _sines(a: Singles, n: int) -> Singles:
    """Discrete sine transform of the first kind, twice the usual one's half: applied twice it is 2 n times a."""
    odd = np.zeros(2 * n, a.dtype)
    odd[1:n] = a
    odd[n + 1 :] = -a[::-1]
    return -np.fft.rfft(odd)[1:n].imag.astype(np.float32)


def travel_time_s(path: Floats, samples: Samples, rate_mm_s: float, accel_mm_s2: float) -> float:
    """Both passes over x = (ds/dt)^2."""
    h = samples.step_mm
    g = np.zeros_like(path)
    g[1:-1] = (path[2:] - path[:-2]) / (h[1:] + h[:-1])[:, None]
    g[0], g[-1] = (path[1] - path[0]) / h[0], (path[-1] - path[-2]) / h[-1]
    c = np.zeros_like(path)
    c[1:-1] = 2.0 * (np.diff(path, axis=0)[1:] / h[1:, None] - np.diff(path, axis=0)[:-1] / h[:-1, None])
    c[1:-1] /= (h[1:] + h[:-1])[:, None]
    c[samples.rests] = 0.0
    bend = np.where(g < 0.0, -c, c)  # as if every axis moved forwards
    size = np.abs(g)
    most = _most(size, bend, h, samples, rate_mm_s, accel_mm_s2)
    controllable = _backward(size, bend, h, most, accel_mm_s2)
    return _forward(size, bend, h, controllable, accel_mm_s2)


def _most(size: Floats, bend: Floats, h: Floats, samples: Samples, rate: float, accel: float) -> Floats:
    """Greatest x at which any acceleration along the path keeps all axes within theirs.

    An axis allows u = s'' within (-+A - bend x) / size; that all of these meet, and that u need not lead below
    x = 0, are bounds on x alone.
    """
    speed = np.linalg.norm(size, axis=1)
    most = (samples.feed_mm_s / np.maximum(speed, 1e-9)) ** 2
    step = np.append(h, h[-1])
    axes = range(size.shape[1])
    for j in axes:
        most = np.minimum(most, (rate / np.maximum(size[:, j], 1e-9)) ** 2)
        rise = 2.0 * step * bend[:, j] - size[:, j]
        most = np.minimum(most, _bound(2.0 * step * accel, rise))
        for k in axes:
            rise = bend[:, k] * size[:, j] - bend[:, j] * size[:, k]
            most = np.minimum(most, _bound(accel * (size[:, j] + size[:, k]), rise))
    result: Floats = np.where(samples.rests, 0.0, most)
    return result


def _bound(room: Floats, rise: Floats) -> Floats:
    """Greatest x with rise x <= room."""
    bound: Floats = np.where(rise > 1e-12, room / np.where(rise > 1e-12, rise, 1.0), np.inf)
    return bound


def _backward(size: Floats, bend: Floats, h: Floats, most: Floats, accel: float) -> Floats:
    """Greatest x at each sample from which what follows can be kept: u <= (next - x) / 2h and each axis' least u."""
    rows = zip(*(column.tolist() for column in (*size.T[:, :-1], *bend.T[:, :-1], h, most[:-1])), strict=True)
    found = [0.0]
    after = 0.0
    for g0, g1, g2, c0, c1, c2, step, cap in reversed(list(rows)):
        room = 2.0 * step * accel
        x = cap
        for g, c in ((g0, c0), (g1, c1), (g2, c2)):
            rise = g - 2.0 * step * c
            if rise > 0.0 and x * rise > after * g + room:
                x = (after * g + room) / rise
        found.append(x)
        after = x
    return np.array(found[::-1])


def _forward(size: Floats, bend: Floats, h: Floats, controllable: Floats, accel: float) -> float:
    """As fast as can be: the greatest u of all axes, never above what can be controlled."""
    rows = zip(*(column.tolist() for column in (*size.T[:, :-1], *bend.T[:, :-1], h, controllable[1:])), strict=True)
    x = v = time_s = 0.0
    for g0, g1, g2, c0, c1, c2, step, cap in rows:
        u = 1e9
        for g, c in ((g0, c0), (g1, c1), (g2, c2)):
            if u * g > accel - c * x:
                u = (accel - c * x) / g
        x = max(0.0, min(x + 2.0 * step * u, cap))
        after: float = x**0.5
        if v + after > 0.0:
            time_s += 2.0 * step / (v + after)
        v = after
    return time_s
