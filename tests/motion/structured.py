"""Paths with structure, as users program them: random points have none, and hide what only structure shows.

Every family is a function of a few parameters -> a Path. `FIXED` is one small set of them for parametrised tests,
`structured_paths()` draws any of them for hypothesis. A path is the vertices of straight moves in mm, the feed of each,
and whether it is a rapid; its coordinates have `decimals`, as a file has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

AXES = 6
Point = tuple[float, ...]


@dataclass(frozen=True)
class Path:
    """Straight moves from the origin, X Y Z."""

    points: tuple[Point, ...]
    feed: int = 1800  # mm/min
    decimals: int = 4
    feeds: tuple[int, ...] = ()  # in turn, instead of feed
    powers: tuple[int, ...] = ()  # S words in turn
    before: tuple[str, ...] = field(default=())  # lines before the first move

    def moves(self) -> list[str]:
        """G-code; the first point is reached by a rapid."""
        lines = []
        for n, point in enumerate(self.points):
            words = "".join(f"{a}{v:.{self.decimals}f}" for a, v in zip("XYZ", point, strict=False))
            feed = self.feeds[n % len(self.feeds)] if self.feeds else self.feed
            code = "G0" if n == 0 else f"G1F{feed}" if n == 1 or self.feeds else ""
            power = f"S{self.powers[n % len(self.powers)]}" if self.powers and n else ""
            lines.append(code + words + power)
        return lines

    def program(self) -> str:
        return "\n".join(["G21G90", *self.before, *self.moves()]) + "\n"

    def vertices(self) -> NDArray[np.float64]:
        """Of all axes, the start included."""
        found = np.zeros((len(self.points) + 1, AXES))
        for n, point in enumerate(self.points, 1):
            found[n, : len(point)] = [float(f"{value:.{self.decimals}f}") for value in point]
            found[n, len(point) :] = found[n - 1, len(point) :]
        return found


def polygon(sides: int, radius: float, start: float = 0.0, laps: int = 2, centre: Point = (0.0, 0.0)) -> list[Point]:
    """Regular and closed, its first vertex at this angle."""
    angles = (start + math.tau * (n % sides) / sides for n in range(sides * laps + 1))
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]


def stairs(count: int, width: float, height: float) -> list[Point]:
    """Chords along X and Y in turn."""
    return [(width * ((n + 1) // 2), height * (n // 2)) for n in range(count)]


def raster(lines: int, length: float, pitch: float) -> list[Point]:
    """To and fro along X, a pitch in Y between."""
    found = []
    for n in range(lines):
        ends = (0.0, length) if n % 2 == 0 else (length, 0.0)
        found += [(x, n * pitch) for x in ends]
    return found


def zigzag(count: int, length: float, angle: float, heading: float = 0.0) -> list[Point]:
    """Equal chords that turn by the same angle to the left and to the right."""
    return headings([heading + (angle / 2 if n % 2 else -angle / 2) for n in range(count)], length)


def spiral(count: int, length: float, turn: float) -> list[Point]:
    """Equal chords that turn by a little more each time."""
    return headings([turn * n * (1 + 0.01 * n) for n in range(count)], length)


def compass(turns: Sequence[int], length: float, part: int = 8) -> list[Point]:
    """Equal chords, each heading a multiple of a turn's part: along axes and, from 8 parts on, at 45 degrees."""
    return headings([math.tau * turn / part for turn in turns], length)


def headings(angles: Sequence[float], length: float) -> list[Point]:
    at, found = (0.0, 0.0), [(0.0, 0.0)]
    for angle in angles:
        at = (at[0] + length * math.cos(angle), at[1] + length * math.sin(angle))
        found.append(at)
    return found


def chessboard(turns: Sequence[int], length: float) -> list[Point]:
    """Chords to whole multiples of a length, along an axis or a diagonal: lengths differ by the root of 2."""
    steps = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
    at, found = (0, 0), [(0.0, 0.0)]
    for turn in turns:
        at = (at[0] + steps[turn % 8][0], at[1] + steps[turn % 8][1])
        found.append((at[0] * length, at[1] * length))
    return found


def long_and_tiny(count: int, long: float, tiny: float, turn: float) -> list[Point]:
    """A tiny chord between each two long ones, and a turn at both its ends."""
    angles, lengths = [turn * n / 2 for n in range(count)], [long, tiny]
    at, found = (0.0, 0.0), [(0.0, 0.0)]
    for n, angle in enumerate(angles):
        length = lengths[n % 2]
        at = (at[0] + length * math.cos(angle), at[1] + length * math.sin(angle))
        found.append(at)
    return found


def wave(count: int, pitch: float, height: float, per_turn: int) -> list[Point]:
    """A sine at even distances in X."""
    return [(pitch * n, height * math.sin(math.tau * n / per_turn)) for n in range(count)]


def mirrored(points: Sequence[Point]) -> list[Point]:
    """There, and back as its mirror image in Y."""
    last = points[-1][0]
    return [*points, *((2 * last - p[0], -p[1]) for p in reversed(points[:-1]))]


def repeated(points: Sequence[Point], times: int = 2) -> list[Point]:
    """Every point several times: moves that lead nowhere."""
    return [point for point in points for _ in range(times)]


def there_and_back(points: Sequence[Point]) -> list[Point]:
    """Reversals, on the very same points."""
    return [*points, *reversed(points[:-1])]


def turned(points: Sequence[Point], plane: str) -> list[Point]:
    """In another plane, or on a slope of 45 degrees."""
    change: dict[str, Callable[[float, float], Point]] = {
        "XY": lambda x, y: (x, y, 0.0),
        "XZ": lambda x, y: (x, 0.0, y),
        "YZ": lambda x, y: (0.0, x, y),
        "YX": lambda x, y: (y, x, 0.0),
        "slope": lambda x, y: (x, y, x),
        "diagonal": lambda x, y: (x - y, x + y, 0.0),
    }
    return [change[plane](p[0], p[1]) for p in points]


PLANES = ("XY", "XZ", "YZ", "YX", "slope", "diagonal")


def _path(points: Sequence[Point], feed: int = 1800, decimals: int = 4, **more: object) -> Path:
    return Path(tuple(tuple(p) for p in points), feed, decimals, **more)  # type: ignore[arg-type]


def _polygons() -> dict[str, Path]:
    """Edges parallel to the axes, at half a part, and at no particular angle."""
    found = {}
    for sides in (3, 4, 5, 6, 8, 12, 16, 20, 24, 36, 48, 72, 120, 360):
        for name, start in (("vertex", 0.0), ("edge", math.pi / sides), ("askew", 0.1)):
            points = polygon(sides, 1.2, start, laps=3)
            found[f"{sides}-gon, {name} first"] = _path(points, decimals=6 if name == "edge" else 4)
    for radius in (0.1, 0.5, 5.0, 20.0):
        found[f"24-gon of radius {radius}"] = _path(polygon(24, radius, math.pi / 24), 3000)
    return found


FIXED: dict[str, Path] = {
    **_polygons(),
    "36-gon that braked at 2.1 x": _path(polygon(36, 1.2, math.pi / 36, laps=4), 1800, 6),
    "square of integers": _path([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], 5000, 0),
    "integers": _path(
        [(0, 0), (3, 0), (3, 4), (0, 4), (4, 1), (4, 2), (5, 2), (5, 5), (2, 2), (2, 0), (0, 0)], 5000, 0
    ),
    "stairs of 1 mm": _path(stairs(60, 1, 1), 5000),
    "stairs of 0.1 mm": _path(stairs(300, 0.1, 0.1), 3000),
    "stairs of 0.01 mm": _path(stairs(600, 0.01, 0.01), 3000),
    "flat stairs": _path(stairs(200, 0.5, 0.005), 5000),
    "raster of 10 mm": _path(raster(16, 10, 0.1), 5000),
    "raster of 1 mm": _path(raster(40, 1, 0.05), 5000),
    "zigzag of 90 degrees": _path(zigzag(60, 0.5, math.pi / 2), 3000),
    "zigzag of 10 degrees": _path(zigzag(120, 0.3, math.radians(10)), 5000),
    "zigzag of 1 degree": _path(zigzag(30, 3.0, math.radians(1)), 5000),
    "zigzag of 170 degrees": _path(zigzag(60, 1.0, math.radians(170)), 5000),
    "zigzag of axis and diagonal": _path(zigzag(60, 1.0, math.pi / 4, math.pi / 8), 5000, 6),
    "spiral": _path(spiral(120, 0.3, 0.02), 5000),
    "compass of 8": _path(
        compass([0, 1, 2, 2, 1, 0, 7, 6, 6, 5, 4, 3, 2, 1, 1, 0, 0, 0, 1, 3, 5, 7] * 3, 0.7), 5000, 6
    ),
    "compass of 4": _path(compass([0, 1, 0, 3, 0, 0, 1, 1, 2, 1, 0, 0, 3, 3] * 3, 0.4, 4), 5000),
    "chessboard": _path(chessboard([0, 1, 2, 3, 4, 5, 6, 7, 0, 0, 1, 1, 2, 2, 1, 0, 7, 0] * 3, 0.5), 5000),
    "tiny chord at each corner": _path(long_and_tiny(60, 3.0, 0.01, math.pi / 2), 5000),
    "tiny chord of a micron": _path(long_and_tiny(60, 2.0, 0.001, math.pi / 2), 5000),
    "tiny chord, straight on": _path(long_and_tiny(80, 1.0, 0.02, 0.05), 5000),
    "wave": _path(wave(200, 0.1, 1.0, 40), 5000),
    "coarse wave": _path(wave(80, 0.5, 1.0, 8), 5000),
    "mirrored wave": _path(mirrored(wave(60, 0.2, 0.8, 20)), 5000),
    "mirrored stairs": _path(mirrored(stairs(40, 0.5, 0.25)), 5000),
    "repeated points": _path(repeated(polygon(24, 1.2, math.pi / 24)), 3000),
    "there and back": _path(there_and_back(wave(40, 0.3, 0.5, 12)), 5000),
    "power every 0.1 mm": _path(wave(200, 0.1, 1.0, 60), 3000, powers=(100, 300, 500)),
    "power every 0.1 mm of a line": _path([(0.1 * n, 0.0) for n in range(200)], 5000, powers=(10, 20)),
    "power every 0.1 mm of a circle": _path(polygon(126, 2.0), 3000, powers=(10, 900)),
    "feeds in turn on a line": _path([(0.4 * n, 0.0) for n in range(60)], feeds=(5000, 300)),
    "feeds in turn on a polygon": _path(polygon(24, 1.2, math.pi / 24), feeds=(4000, 1000, 200)),
    "feeds in turn on stairs": _path(stairs(60, 0.5, 0.5), feeds=(5000, 500)),
    **{f"24-gon in {plane}": _path(turned(polygon(24, 1.2, math.pi / 24), plane), decimals=6) for plane in PLANES[1:]},
    **{f"stairs in {plane}": _path(turned(stairs(60, 0.4, 0.4), plane), 5000) for plane in PLANES[1:]},
    "rapids round a square": _path([(5, 0), (5, 5), (0, 5), (0, 0)] * 3, feeds=(20000,)),
}

_feeds = st.sampled_from([100, 600, 1800, 3000, 5000, 20000])
_lengths = st.sampled_from([0.004, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 3.0])
_turns = st.lists(st.integers(0, 7), min_size=4, max_size=60)


@st.composite
def _polygon_points(draw: st.DrawFn) -> list[Point]:
    sides = draw(st.sampled_from([3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 36, 48, 64, 90, 120]))
    start = draw(st.sampled_from([0.0, math.pi / sides, math.pi / 2 / sides, math.pi / 4, 0.1]))
    radius = draw(st.sampled_from([0.05, 0.2, 0.5, 1.0, 1.2, 2.0, 5.0]))
    centre = draw(st.sampled_from([(0.0, 0.0), (10.0, 10.0), (-radius, 0.0), (3.7, -1.3)]))
    return polygon(sides, radius, start, draw(st.integers(1, 4)), centre)


def _families() -> st.SearchStrategy[list[Point]]:
    count, angle = (
        st.integers(4, 80),
        st.sampled_from([math.radians(a) for a in (1, 5, 15, 30, 45, 60, 90, 120, 135, 170)]),
    )
    return st.one_of(
        _polygon_points(),
        _polygon_points(),
        st.builds(stairs, count, _lengths, _lengths),
        st.builds(raster, st.integers(2, 16), st.sampled_from([0.5, 2.0, 8.0]), _lengths),
        st.builds(zigzag, count, _lengths, angle, st.sampled_from([0.0, math.pi / 8, math.pi / 4, math.pi / 2])),
        st.builds(spiral, count, _lengths, st.sampled_from([0.01, 0.1, 0.3])),
        st.builds(compass, _turns, _lengths, st.sampled_from([4, 8, 12, 24])),
        st.builds(chessboard, _turns, _lengths),
        st.builds(long_and_tiny, count, st.sampled_from([0.5, 2.0]), st.sampled_from([0.001, 0.005, 0.02, 0.1]), angle),
        st.builds(wave, count, _lengths, st.sampled_from([0.01, 0.1, 1.0]), st.sampled_from([4, 6, 12, 40])),
    )


@st.composite
def structured_paths(draw: st.DrawFn) -> Path:
    """Any family, perhaps mirrored, repeated or reversed, in any plane, with one feed or several."""
    change = draw(st.sampled_from([list, list, list, mirrored, repeated, there_and_back]))
    points = turned(change(draw(_families())), draw(st.sampled_from(PLANES)))
    feeds = draw(st.one_of(st.just(()), st.lists(_feeds, min_size=2, max_size=3).map(tuple)))
    powers = draw(st.sampled_from([(), (), (10, 900)]))
    return _path(points, draw(_feeds), draw(st.sampled_from([2, 3, 4, 6])), feeds=feeds, powers=powers)
