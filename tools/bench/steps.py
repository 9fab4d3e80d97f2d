"""What a trace of step events says: time, acceleration, jerk, and how far the path lies from the programmed one.

Positions between two events are interpolated; derivatives are box differences over a window, which hides the grain of
single steps: one step of 1/n mm is 1/(n W^2) of acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.program import Floats, Programmed

# struct trace_event of targets/pc/trace.h
EVENT = np.dtype([("t", "<u8"), ("step", "u1"), ("dir", "u1"), ("flags", "u1"), ("dwells", "u1"), ("line", "<u4")])
PARTS = 10  # samples in a window
GROUP = 16  # stretches of one source line that are matched together
CHUNK = 1000  # events that are matched together
REACH_MM = 0.5  # farther chords are not looked at


@dataclass(frozen=True)
class Steps:
    """Step events of X, Y and Z."""

    t_s: Floats
    at_mm: Floats  # (n, 3), after each event
    line: NDArray[np.int64]  # source line of each event
    pause_s: float  # in dwells


@dataclass(frozen=True)
class Deviation:
    """Greatest distances: of the steps from the programmed path, and of its vertices from the steps."""

    path_mm: float
    line: int  # where path_mm is
    vertex_mm: float


def read_steps(path: Path, timer_hz: float, steps_per_mm: Floats, lines_before: int) -> Steps:
    """lines_before: taken by the controller before the first of the program."""
    events = np.fromfile(path, EVENT)
    t_s = events["t"] / timer_hz
    at = np.empty((len(events), 3))
    for axis in range(3):
        stepped = (events["step"] >> axis & 1).astype(np.int8)
        sense = 1 - 2 * (events["dir"] >> axis & 1).astype(np.int8)
        at[:, axis] = np.cumsum(stepped * sense, dtype=np.int64) / steps_per_mm[axis]
    dwelt = np.diff(events["dwells"]) != 0
    return Steps(t_s, at, events["line"].astype(np.int64) - lines_before, float(np.diff(t_s)[dwelt].sum()))


def derivative(steps: Steps, order: int, window_s: float) -> Floats:
    """Of the axis where it is greatest, 10 times per window: 1 speed, 2 acceleration, 3 jerk. mm, s."""
    t = steps.t_s
    grid = np.arange(t[0] - (order + 1) * window_s, t[-1] + (order + 1) * window_s, window_s / PARTS)
    most = np.zeros(len(grid) - order * PARTS)
    for axis in range(3):
        q = np.interp(grid, *_own_steps(t, steps.at_mm[:, axis]))
        for _ in range(order):
            q = (q[PARTS:] - q[:-PARTS]) / window_s
        np.maximum(most, np.abs(q), out=most)
    return most


def _own_steps(t_s: Floats, at_mm: Floats) -> tuple[Floats, Floats]:
    """Of one axis, without the events at which only others step: at these it is between two of its steps, and to say
    that it still is where the last one left it would move it by up to a step."""
    own = np.flatnonzero(np.diff(at_mm, prepend=0.0))
    return (t_s[own], at_mm[own]) if len(own) else (t_s[:1], at_mm[:1])


def deviation(steps: Steps, program: Programmed) -> Deviation:
    """Both ways, in the order of the program: steps of some source lines against the chords of these lines and of
    their neighbours."""
    places = np.vstack([program.points_mm[:1], steps.at_mm])
    lines = np.concatenate([steps.line[:1], steps.line])
    starts = np.flatnonzero(np.diff(lines, prepend=lines[0] - 1))
    labels = lines[starts]
    starts = np.append(starts, len(lines))
    nearest = np.full(len(program.points_mm), np.inf)  # of each vertex
    worst, worst_line = 0.0, 0
    for k in range(0, len(labels), GROUP):
        low = labels[k - 3] if k >= 3 else 0
        after = k + GROUP + 1
        high = labels[after] if after < len(labels) else program.line[-1]
        chords = np.flatnonzero((program.line > low) & (program.line <= high))
        for begin in range(starts[k], starts[min(k + GROUP, len(labels))], CHUNK):
            end = min(begin + CHUNK, starts[min(k + GROUP, len(labels))])
            far = _match(places[begin:end], program.points_mm, chords, nearest)
            index = int(np.argmax(far))
            if far[index] > worst:
                worst, worst_line = float(far[index]), int(lines[begin + index])
    seen = nearest[np.isfinite(nearest)]
    return Deviation(worst, worst_line, float(seen.max()) if len(seen) else 0.0)


def _match(places: Floats, points: Floats, chords: NDArray[np.int64], nearest: Floats) -> Floats:
    """Distance of each place from the nearest of these chords; notes how near each vertex was passed."""
    low, high = places.min(axis=0) - REACH_MM, places.max(axis=0) + REACH_MM
    begin, end = points[chords], points[chords + 1]
    near = (np.minimum(begin, end) <= high).all(axis=1) & (np.maximum(begin, end) >= low).all(axis=1)
    if not near.any():
        return np.full(len(places), REACH_MM)
    begin, end, chords = begin[near], end[near], chords[near]
    chord = end - begin
    from_begin = places[:, None] - begin
    along = np.einsum("pcx,cx->pc", from_begin, chord) / np.einsum("cx,cx->c", chord, chord)
    off = from_begin - np.clip(along, 0.0, 1.0)[:, :, None] * chord
    vertex = np.sqrt(np.einsum("pcx,pcx->pc", from_begin, from_begin).min(axis=0))
    nearest[chords] = np.minimum(nearest[chords], vertex)
    far: Floats = np.sqrt(np.einsum("pcx,pcx->pc", off, off).min(axis=1))
    return far
