"""Programmed paths as the standard has them, read without any of our own code: the oracle of the measurements.

Knows straight moves, arcs, planes, units and distance modes (RS274/NGC); a program with more than that is refused.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Words = list[tuple[str, float]]

WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
COMMENT = re.compile(r"\([^)]*\)|;.*")
RAPID_MM_S = 1e9
ARC_CHORD_MM = 0.0002  # how far an arc's chords may lie off it
PLANES = {17.0: (0, 1, 2), 18.0: (2, 0, 1), 19.0: (1, 2, 0)}
MOTIONS = (0.0, 1.0, 2.0, 3.0)
WITHOUT_MOTION = {4.0, 40.0, 49.0, 54.0, 64.0, 80.0, 90.1, 91.1, 94.0, *PLANES, 20.0, 21.0, 90.0, 91.0}
# The machine is at rest while these act.
STOPS = {("G", 4.0), *(("M", float(code)) for code in (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 30))}


@dataclass(frozen=True)
class Programmed:
    """Vertices in mm; chord i leads from vertex i to i + 1. X, Y and Z."""

    points_mm: Floats  # (n + 1, 3)
    feed_mm_s: Floats  # (n,), RAPID_MM_S for rapids
    line: NDArray[np.int64]  # (n,), 1-based
    rests: NDArray[np.bool_]  # (n + 1,), the machine rests at this vertex


@dataclass
class _State:
    """The modal state, and what was collected."""

    at: list[float] = field(default_factory=lambda: [0.0] * 3)
    unit: float = 1.0
    absolute: bool = True
    plane: tuple[int, int, int] = PLANES[17.0]
    motion: float = 0.0
    feed_mm_s: float = 0.0
    points: list[list[float]] = field(default_factory=lambda: [[0.0] * 3])
    feeds: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    rests: list[int] = field(default_factory=lambda: [0])


def read_program(path: Path) -> Programmed:
    """Raises ValueError: a word that this reader does not know."""
    state = _State()
    for number, text in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        words = _words(text, path, number)
        if any(word in STOPS for word in words):
            state.rests.append(len(state.points) - 1)
        if _apply_modes(state, words):
            _move(state, words, number)
        if ("M", 2.0) in words or ("M", 30.0) in words:
            break
    return _collect(state)


def _collect(state: _State) -> Programmed:
    points = np.array(state.points)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    kept = length > 1e-9
    index = np.concatenate([[0], np.cumsum(kept)])  # of each old vertex among the new ones
    rests = np.zeros(int(kept.sum()) + 1, bool)
    rests[index[state.rests]] = True
    rests[[0, -1]] = True
    vertices = points[np.concatenate([[True], kept])]
    return Programmed(vertices, np.array(state.feeds)[kept], np.array(state.lines)[kept], rests)


def _words(text: str, path: Path, number: int) -> Words:
    plain = re.sub(r"\s", "", COMMENT.sub("", text)).upper().strip("%")
    words = [(letter, float(value)) for letter, value in WORD.findall(plain)]
    known = "".join(f"{letter}{value}" for letter, value in WORD.findall(plain)) == plain
    codes = [value for letter, value in words if letter == "G"]
    if not known or any(code not in WITHOUT_MOTION and code not in MOTIONS for code in codes):
        raise ValueError(f"{path.name}:{number}: {text.strip()!r} is more than this reader knows")
    return words


def _apply_modes(state: _State, words: Words) -> bool:
    """@return whether the line moves"""
    codes = [value for letter, value in words if letter == "G"]
    for code in codes:
        if code in PLANES:
            state.plane = PLANES[code]
        elif code in (20.0, 21.0):
            state.unit = 25.4 if code == 20.0 else 1.0
        elif code in (90.0, 91.0):
            state.absolute = code == 90.0
        elif code in MOTIONS:
            state.motion = code
    for letter, value in words:
        if letter == "F":
            state.feed_mm_s = value * state.unit / 60.0
    letters = {letter for letter, _ in words}
    return 4.0 not in codes and bool(letters & set("XYZ") or (state.motion >= 2.0 and letters & set("IJKR")))


def _move(state: _State, words: Words, number: int) -> None:
    target = list(state.at)
    for letter, value in words:
        if letter in "XYZ":
            axis = "XYZ".index(letter)
            target[axis] = value * state.unit + (0.0 if state.absolute else state.at[axis])
    arc = state.motion in (2.0, 3.0)
    points = _arc(state, words, target) if arc else [target]
    state.points += points
    state.feeds += [RAPID_MM_S if state.motion == 0.0 else state.feed_mm_s] * len(points)
    state.lines += [number] * len(points)
    state.at = target


def _arc(state: _State, words: Words, target: list[float]) -> list[list[float]]:
    """Chord ends, each from the absolute angle."""
    a, b, along = state.plane
    from_a, from_b = state.at[a], state.at[b]
    centre = _centre(state, dict(words), target)
    begin = math.atan2(from_b - centre[1], from_a - centre[0])
    turn = math.atan2(target[b] - centre[1], target[a] - centre[0]) - begin
    clockwise = state.motion == 2.0
    if clockwise and turn >= -1e-9:
        turn -= math.tau
    elif not clockwise and turn <= 1e-9:
        turn += math.tau
    radius = math.hypot(from_a - centre[0], from_b - centre[1])
    end_radius = math.hypot(target[a] - centre[0], target[b] - centre[1])
    count = max(1, math.ceil(abs(turn) / (2.0 * math.acos(max(0.0, 1.0 - ARC_CHORD_MM / radius)))))
    points = []
    for n in range(1, count + 1):
        part = n / count
        angle, r = begin + turn * part, radius + (end_radius - radius) * part
        point = [0.0] * 3
        point[a], point[b] = centre[0] + r * math.cos(angle), centre[1] + r * math.sin(angle)
        point[along] = state.at[along] + (target[along] - state.at[along]) * part
        points.append(point)
    points[-1] = target
    return points


def _centre(state: _State, words: dict[str, float], target: list[float]) -> tuple[float, float]:
    """From I J K, which are relative to the start, or from R: the centre left of the chord for a G3 of up to 180°."""
    a, b, _ = state.plane
    if "R" not in words:
        offsets = [words.get(letter, 0.0) * state.unit for letter in "IJK"]
        return state.at[a] + offsets[a], state.at[b] + offsets[b]
    radius = words["R"] * state.unit
    to_a, to_b = target[a] - state.at[a], target[b] - state.at[b]
    chord = math.hypot(to_a, to_b)
    height = math.sqrt(max(0.0, radius * radius - chord * chord / 4.0))
    side = 1.0 if (state.motion == 3.0) == (radius > 0.0) else -1.0
    left_a, left_b = -to_b / chord, to_a / chord
    return (
        state.at[a] + to_a / 2.0 + side * height * left_a,
        state.at[b] + to_b / 2.0 + side * height * left_b,
    )
