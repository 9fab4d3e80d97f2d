"""What must hold for a motion, whatever was programmed, taken from its step edges alone.

Speed and acceleration are box differences over a window W of positions that are interpolated between edges, so single
steps that are early or late count as up to 2/(n W^2) of acceleration, n steps/mm: with 2000 steps/mm and 10 ms that is
10 mm/s2, and what is left of a figure is motion, not grain. On diagonals of two fast axes it can be up to twice as much
for the slower one: grain_mm_s2().
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from motion_host import AXES, BASELINE, Host, Run
from numpy.typing import NDArray

FINE_PER_MM = 2000.0
WINDOWS_S = (0.005, 0.010, 0.020)
# Of the limit, beyond the grain: 1.2 over 10 ms was asked, this is kept. A segment of up to 4 ms is a chord with one
# ramp for all axes, and the speeds of a turning path jump where two of them meet: seen over 5 ms, hardly over 20 ms.
ALLOWED = (1.15, 1.05, 1.02)
# core/step/prep.c: slow steps of the dominant axis are divided into events, up to this rate or into so many.
SMOOTH_EVENT_HZ, MOST_PARTS = 32_000.0, 16.0
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Machine:
    """Limits of X, Y and Z."""

    steps_per_mm: tuple[float, float, float] = (FINE_PER_MM,) * 3
    rate_mm_min: tuple[float, float, float] = (5000.0,) * 3
    accel_mm_s2: tuple[float, float, float] = (500.0,) * 3
    deviation_mm: float = 0.01
    arc_mm: float = 0.002
    jerk_mm_s3: float = 0.0
    shapers: tuple[tuple[int, float, float], ...] = ()  # of X, Y, Z: kind, Hz, damping

    def settings(self) -> dict[str, float]:
        rows = zip((100, 110, 120), (self.steps_per_mm, self.rate_mm_min, self.accel_mm_s2), strict=True)
        found = {f"s{base + ax}": value for base, values in rows for ax, value in enumerate(values)}
        for ax, values in enumerate(self.shapers):
            found |= {f"s{base + ax}": value for base, value in zip((170, 180, 190), values, strict=True)}
        return found | {"s11": self.deviation_mm, "s12": self.arc_mm, "s40": self.jerk_mm_s3, "s32": 1}

    def host(self) -> Host:
        host = Host(rate_hz=900_000, pulse_ns=500, axes=3)
        host.settings(**self.settings())
        return host


FINE = Machine()
COARSE = Machine(steps_per_mm=tuple(BASELINE[f"s{100 + ax}"] for ax in range(3)))  # type: ignore[arg-type]


def derivatives(t_s: Floats, at_steps: NDArray[np.int64], machine: Machine, window_s: float) -> tuple[Floats, Floats]:
    """Speed and acceleration of X, Y and Z."""
    if len(t_s) == 0:
        return np.zeros((1, 3)), np.zeros((1, 3))
    t = np.concatenate([[t_s[0] - 1e-3], t_s])
    path = np.vstack([np.zeros(3), at_steps[:, :3]]) / np.array(machine.steps_per_mm)
    grid = np.arange(t[0] - 3 * window_s, t[-1] + 3 * window_s, window_s / 10)
    q = np.stack([np.interp(grid, t, path[:, ax]) for ax in range(3)], axis=1)
    v = (q[10:] - q[:-10]) / window_s
    return v, (v[10:] - v[:-10]) / window_s


def noise_steps(speed_mm_s: Floats, machine: Machine) -> Floats:
    """How many steps each axis may be from where it is due, because all axes step at the dominant axis' events.

    At f steps/s and events that are E apart it is f E, at most 1. A step comes at the nearest event, up to E/2 early or
    late; and a segment makes just the steps that are due in it (core/step/prep.c), so all of them may be shifted by
    E/2 more. The dominant axis makes the events, so it is exact. It has more steps than any other: surely, if it is
    faster by two steps in each segment.
    """
    hz = np.abs(speed_mm_s) * np.array(machine.steps_per_mm)
    fastest_hz = np.maximum(hz.max(axis=1, keepdims=True), 1.0)
    event_s = np.minimum(1 / fastest_hz, np.maximum(1 / SMOOTH_EVENT_HZ, 1 / (MOST_PARTS * fastest_hz)))
    others_hz = np.stack([np.delete(hz, ax, axis=1).max(axis=1) for ax in range(hz.shape[1])], axis=1)
    segment_s = 0.002 if machine.deviation_mm > 0 else 0.0005
    return np.where(hz > others_hz + 2 / segment_s, 0.0, hz * event_s)


def grain_mm_s2(speed_mm_s: Floats, machine: Machine, window_s: float) -> Floats:
    """Of each acceleration that belongs to these speeds: what may be steps, and no motion.

    With g = noise_steps(), a position that is interpolated between steps is at most g + 1/2 before its axis and 1/2
    after it: within (1 + g)/2 of the middle. An acceleration is q(t + W) - 2 q(t) + q(t - W), so it may have four times
    that. Half of it, 2 steps, is what the dominant axis has near to rest.
    """
    noise = noise_steps(speed_mm_s, machine)
    steps = 2.0 + 2.0 * np.maximum(noise[10:], noise[:-10])
    return steps / (np.array(machine.steps_per_mm) * window_s**2)


def accelerations(t_s: Floats, at_steps: NDArray[np.int64], machine: Machine) -> list[float]:
    """Greatest of any axis over windows of 5, 10 and 20 ms, in its limit, without the grain of two steps."""
    found = []
    for window_s in WINDOWS_S:
        _, accel = derivatives(t_s, at_steps, machine, window_s)
        grain = 2.0 / (np.array(machine.steps_per_mm) * window_s**2)
        found.append(float(((np.abs(accel) - grain) / machine.accel_mm_s2).max()))
    return found


def assert_accelerations(t_s: Floats, at_steps: NDArray[np.int64], machine: Machine) -> list[float]:
    found = accelerations(t_s, at_steps, machine)
    text = ", ".join(f"{x:.3f} x in {1e3 * w:.0f} ms" for x, w in zip(found, WINDOWS_S, strict=True))
    assert all(x <= most for x, most in zip(found, ALLOWED, strict=True)), f"acceleration {text}"
    return found


def assert_lawful(run: Run, machine: Machine) -> list[float]:
    """Limits, counters, and a plan that was followed. @return the accelerations, for the record"""
    assert run.counted() == run.position
    assert run.counters.plan_unmet == 0
    assert run.counters.underruns == 0
    speed, _ = derivatives(run.seconds(), run.positions(), machine, 0.010)
    grain = 2.0 / (np.array(machine.steps_per_mm) * 0.010)  # a step of a minor axis waits for the dominant axis' event
    assert (np.abs(speed).max(axis=0) <= np.array(machine.rate_mm_min) / 60 * 1.001 + grain).all()
    return assert_accelerations(run.seconds(), run.positions(), machine)


def assert_ends_at(run: Run, target_mm: Sequence[float], machine: Machine) -> None:
    """To the step."""
    wanted = np.array(target_mm[:3]) * machine.steps_per_mm
    assert np.abs(np.array(run.position[:3]) - wanted).max() <= 0.5 + 1e-3


def away_mm(run: Run, vertices: Floats, machine: Machine, places: int = 3000) -> float:
    """Greatest distance of a position from the polygon with these vertices, at so many places of the path."""
    stride = max(1, len(run.events) // places)
    at = run.positions()[::stride, :3] / np.array(machine.steps_per_mm)
    begin, chord = vertices[:-1, :3], np.diff(vertices[:, :3], axis=0)
    worst = 0.0
    for part in np.array_split(at, max(1, len(at) // 300)):
        from_begin = part[:, None] - begin
        along = np.einsum("pcx,cx->pc", from_begin, chord) / np.maximum((chord**2).sum(axis=1), 1e-15)
        off = from_begin - np.clip(along, 0, 1)[:, :, None] * chord
        worst = max(worst, float(np.sqrt((off**2).sum(axis=2)).min(axis=1).max(initial=0)))
    return worst


def path_grain_mm(machine: Machine) -> float:
    """Half a step of each axis, and half an event of the fastest one."""
    steps = 1.0 / np.array(machine.steps_per_mm)
    return 0.5 * float(np.linalg.norm(steps)) + 0.5 * float(steps.max())


def assert_on_path(run: Run, vertices: Floats, machine: Machine, tolerance_mm: float) -> None:
    """docs/motion.md, 10: the tolerance, 4.5 % of it for sampling, and the steps."""
    assert away_mm(run, vertices, machine) <= tolerance_mm * 1.045 + path_grain_mm(machine) + 1e-4


def assert_reaches(run: Run, vertices: Floats, machine: Machine, tolerance_mm: float) -> None:
    """Each vertex, one after the other: assert_on_path() does not see a way back that begins before its vertex."""
    places = np.vstack([np.zeros(3), run.positions()[:, :3] / np.array(machine.steps_per_mm)])
    most_mm, at = tolerance_mm * 1.045 + path_grain_mm(machine) + 1e-4, 0
    for vertex in vertices:
        near = np.linalg.norm(places[at:] - vertex, axis=1) <= most_mm
        assert near.any(), vertex
        at += int(np.argmax(near))


assert AXES == 6
