"""Random programs: lines, arcs, planes, feeds, units, six axes, tiny and huge moves, all path modes.

What must hold for any of them is asked of the step edges alone: pulses are counted, every axis keeps its speed and
acceleration, the path stays within what was asked, ends and exact stops are exact, and nothing starves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motion_host import AXES, BASELINE, Host, Run
from numpy.typing import NDArray

LETTERS = "XYZABC"
STEPS_PER_MM, RATE_MM_S, ACCEL_MM_S2 = 250.0, 5000 / 60, 500.0
DEVIATION_MM, ARC_MM = 0.01, 0.002
CHORD_MM = 0.0005  # how far the oracle's chords may lie off an arc
STEP_MM = 1 / STEPS_PER_MM
WINDOW_S = 0.020
# A step of a minor axis may come half a step early or late at each end of both windows.
GRAIN_MM_S2 = 2 / (STEPS_PER_MM * WINDOW_S**2)
Points = NDArray[np.float64]

common = settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])


@dataclass
class Program:
    """Text, and the path that it means: vertices of every move, and where it must rest."""

    lines: list[str]
    points: list[NDArray[np.float64]] = field(default_factory=lambda: [np.zeros(AXES)])
    rests: list[int] = field(default_factory=list)

    def to(self, target: NDArray[np.float64]) -> None:
        self.points.append(target)

    @property
    def at(self) -> NDArray[np.float64]:
        return self.points[-1]


sizes = st.sampled_from([0.0004, 0.003, 0.02, 0.15, 1.0, 6.0, 25.0])
feeds = st.sampled_from([40, 300, 1500, 5000, 20000])


@st.composite
def line_programs(draw: st.DrawFn, axes: int, exact: bool = False) -> Program:
    """Straight moves; with `exact` some of them in G61. Coordinates have four decimals of the unit in force."""
    program = Program([])
    inch = draw(st.booleans())
    incremental = draw(st.booleans())
    unit = 25.4 if inch else 1.0
    program.lines.append(f"{'G20' if inch else 'G21'}{'G91' if incremental else 'G90'}G1F{draw(feeds) / unit:.3f}")
    word = np.zeros(AXES)
    for _ in range(draw(st.integers(2, 40))):
        if exact and draw(st.integers(0, 5)) == 0:
            program.lines.append(draw(st.sampled_from(["G61", "G64", "G61.1"])))
        size = draw(sizes) / unit
        by = np.array([round(draw(st.floats(-size, size)), 4) if ax < axes else 0.0 for ax in range(AXES)])
        before, word = word, np.clip(np.round(word + by, 4), -80 / unit, 80 / unit)
        shown = word - before if incremental else word
        text = draw(st.sampled_from(["G1", "G1", "G0", f"G1F{draw(feeds) / unit:.3f}"]))
        program.lines.append(text + "".join(f"{a}{v:.4f}" for a, v in zip(LETTERS[:axes], shown, strict=False)))
        scale = np.where(np.arange(AXES) < 3, unit, 1.0)  # rotary axes are degrees in inches, too
        program.to(word * scale)
    return program


def performed(program: Program, axes: int, **extra: float) -> Run:
    host = Host(axes=axes)
    host.settings(
        **{k: v for k, v in BASELINE.items() if int(k[1:]) % 10 < axes}, s11=DEVIATION_MM, s12=ARC_MM, **extra
    )
    run = host.run("\n".join(program.lines) + "\n")
    host.close()
    assert run.answers == ["ok"] * len(program.lines)
    return run


def assert_lawful(run: Run, program: Program) -> None:
    """Invariants 1 and 2, exact ends, and look-ahead that never ran dry."""
    assert run.counted() == run.position
    assert np.abs(np.array(run.position) - program.at * STEPS_PER_MM).max() <= 0.5 + 1e-3
    assert run.counters.lookahead_starved == 0 and run.counters.underruns == 0
    speed, accel = derivatives(run)
    assert np.abs(speed).max(initial=0) <= RATE_MM_S * 1.001 + STEP_MM / WINDOW_S
    assert np.abs(accel).max(initial=0) <= ACCEL_MM_S2 * 1.005 + GRAIN_MM_S2


def derivatives(run: Run) -> tuple[Points, Points]:
    """Speed and acceleration per axis by box differences of the interpolated positions."""
    if len(run.events) == 0:
        return np.zeros((0, AXES)), np.zeros((0, AXES))
    t = np.concatenate([[run.seconds()[0] - 1e-3], run.seconds()])
    path = np.vstack([np.zeros(AXES), run.positions()]) / STEPS_PER_MM
    grid = np.arange(t[0] - 3 * WINDOW_S, t[-1] + 3 * WINDOW_S, WINDOW_S / 10)
    q = np.stack([np.interp(grid, t, path[:, ax]) for ax in range(AXES)], axis=1)
    v = (q[10:] - q[:-10]) / WINDOW_S
    return v, (v[10:] - v[:-10]) / WINDOW_S


def away_mm(run: Run, points: list[NDArray[np.float64]]) -> float:
    """Greatest distance of a position from the programmed path."""
    vertices = np.array(points)
    begin, chord = vertices[:-1], np.diff(vertices, axis=0)
    places = run.positions()[::3] / STEPS_PER_MM
    worst = 0.0
    for part in np.array_split(places, max(1, len(places) // 400)):
        from_begin = part[:, None] - begin
        along = np.einsum("pcx,cx->pc", from_begin, chord) / np.maximum((chord**2).sum(axis=1), 1e-15)
        off = from_begin - np.clip(along, 0, 1)[:, :, None] * chord
        worst = max(worst, float(np.sqrt((off**2).sum(axis=2)).min(axis=1).max(initial=0)))
    return worst


def reached_mm(run: Run, points: list[NDArray[np.float64]]) -> float:
    """Greatest distance of a programmed vertex from the positions."""
    places = np.vstack([np.zeros(AXES), run.positions()]) / STEPS_PER_MM
    return max(float(np.sqrt(((places - point) ** 2).sum(axis=1)).min()) for point in points)


def grain_mm(axes: int) -> float:
    """A position is a lattice point: half a step on every axis, and the dominant axis' half event."""
    return 0.5 * STEP_MM * math.sqrt(axes) + 0.5 * STEP_MM


@pytest.mark.slow
@common
@given(program=line_programs(axes=3))
def test_lines_of_three_axes(program: Program) -> None:
    run = performed(program, 3)
    assert_lawful(run, program)
    assert away_mm(run, program.points) <= DEVIATION_MM + grain_mm(3)
    assert reached_mm(run, program.points) <= DEVIATION_MM + grain_mm(3)


@pytest.mark.slow
@common
@given(program=line_programs(axes=6))
def test_lines_of_six_axes(program: Program) -> None:
    run = performed(program, 6)
    assert_lawful(run, program)
    assert away_mm(run, program.points) <= DEVIATION_MM + grain_mm(6)
    assert reached_mm(run, program.points) <= DEVIATION_MM + grain_mm(6)


@common
@given(program=line_programs(axes=3), jerk=st.sampled_from([8_000, 50_000, 400_000]))
def test_lines_with_limited_jerk(program: Program, jerk: int) -> None:
    run = performed(program, 3, s40=jerk)
    assert_lawful(run, program)
    assert away_mm(run, program.points) <= DEVIATION_MM + grain_mm(3)


@pytest.mark.slow
@common
@given(program=line_programs(axes=3, exact=True))
def test_exact_stops_are_reached_to_the_step(program: Program) -> None:
    run = performed(program, 3)
    assert_lawful(run, program)
    lattice = {tuple(place) for place in run.positions().tolist()} | {(0,) * AXES}
    mode, vertex = "G64", 0
    for line in program.lines[1:]:
        if line in ("G61", "G64", "G61.1"):
            mode = line
            continue
        vertex += 1
        if mode != "G64":
            assert nearest(program.points[vertex]) & lattice, (line, program.points[vertex])


def nearest(point: NDArray[np.float64]) -> set[tuple[int, ...]]:
    """Nearest lattice point; two of each axis that lies within rounding of half way."""
    found: set[tuple[int, ...]] = {()}
    for value in point * STEPS_PER_MM:
        found = {(*steps, math.floor(value + 0.5 + by)) for steps in found for by in (-1e-4, 1e-4)}
    return found


@common
@given(program=line_programs(axes=3), tolerance=st.sampled_from([0.0, 0.02, 0.1, 0.5]))
def test_a_path_tolerance_is_kept(program: Program, tolerance: float) -> None:
    unit = 25.4 if program.lines[0].startswith("G20") else 1.0
    program.lines.insert(1, f"G64P{tolerance / unit:.6f}")
    run = performed(program, 3)
    assert_lawful(run, program)
    assert away_mm(run, program.points) <= max(DEVIATION_MM, tolerance) + 1e-5 + grain_mm(3)


@st.composite
def arc_programs(draw: st.DrawFn) -> Program:
    """Arcs and helices of all planes, by I J K; each continues where the one before ended."""
    program = Program(["G21G90G1F5000"])
    for _ in range(draw(st.integers(1, 6))):
        code, (a, b, along) = draw(st.sampled_from([("G17", (0, 1, 2)), ("G18", (2, 0, 1)), ("G19", (1, 2, 0))]))
        radius = draw(st.sampled_from([0.05, 0.6, 3.0, 15.0]))
        begin = draw(st.floats(0, math.tau))
        sweep = draw(st.floats(0.05, math.tau)) * draw(st.sampled_from([-1, 1]))
        rise = draw(st.sampled_from([0.0, 0.0, 0.7, -4.0]))
        centre = program.at.copy()
        centre[a] -= radius * math.cos(begin)
        centre[b] -= radius * math.sin(begin)
        offset = np.round(centre - program.at, 4)
        centre = program.at + offset
        true_radius = math.hypot(offset[a], offset[b])
        begin = math.atan2(-offset[b], -offset[a])
        target = centre.copy()
        target[a] = round(centre[a] + true_radius * math.cos(begin + sweep), 4)
        target[b] = round(centre[b] + true_radius * math.sin(begin + sweep), 4)
        target[along] = round(program.at[along] + rise, 4)
        words = "".join(f"{LETTERS[ax]}{target[ax]:.4f}" for ax in range(3))
        words += f"{'IJK'[a]}{offset[a]:.4f}{'IJK'[b]}{offset[b]:.4f}"
        program.lines.append(f"{code}{'G3' if sweep > 0 else 'G2'}{words}F{draw(feeds)}")
        _add_arc(program, centre, (a, b, along), target, sweep > 0)
    return program


def _add_arc(
    program: Program, centre: NDArray[np.float64], plane: tuple[int, int, int], target: NDArray[np.float64], left: bool
) -> None:
    a, b, along = plane
    start = program.at - centre
    end = target - centre
    begin, turn = math.atan2(start[b], start[a]), 0.0
    turn = (math.atan2(end[b], end[a]) - begin) % math.tau
    turn = turn if left else turn - math.tau
    if abs(turn) < 1e-9:
        turn = math.tau if left else -math.tau
    r0, r1 = math.hypot(start[a], start[b]), math.hypot(end[a], end[b])
    from_along = program.at[along]
    for part in np.linspace(0, 1, 2 + int(abs(turn) * math.sqrt(r0 / (8 * CHORD_MM))))[1:]:
        point = program.at.copy()
        point[a] = centre[a] + (r0 + (r1 - r0) * part) * math.cos(begin + turn * part)
        point[b] = centre[b] + (r0 + (r1 - r0) * part) * math.sin(begin + turn * part)
        point[along] = from_along + (target[along] - from_along) * part
        program.to(point)
    program.points[-1] = target


@pytest.mark.slow
@settings(common, max_examples=25)
@given(program=arc_programs())
def test_arcs_of_all_planes(program: Program) -> None:
    """An arc's chords and the rounding of its corners share the tolerance."""
    run = performed(program, 3)
    assert_lawful(run, program)
    assert away_mm(run, program.points) <= DEVIATION_MM + CHORD_MM + grain_mm(3)
