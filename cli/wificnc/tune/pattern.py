"""A test pattern that shows the vibration of one axis as waves along a line. Plain Grbl 1.1h. Pure.

Each row comes in along the tested axis, turns by 90 degrees, and continues along the other axis at the feed F. At the
corner the tested axis stops, and what then vibrates draws waves along the line, F / f apart. How large they are depends
on how long the axis slows down: with the acceleration A a ramp of half a period leaves the most, 2 A / w^2, which is
twice the deflection by A, and a ramp of a whole period leaves nothing. So the rows come in at different feeds: each has
the ramp for another frequency, A / (2 f) fast, and the row nearest to the frame's frequency has the clearest waves. A
corner of 90 degrees is almost a stop for any planner, whatever its junction deviation is, so this holds on any Grbl.
The waves are evenly spaced from where the other axis has reached F.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from wificnc.errors import UserError
from wificnc.tables import load_settings

REFERENCE_MM = 1.5  # from a row to the straight line that it is compared with
PERIODS_BEFORE = 8.0  # at constant feed before the corner: the vibration of the start has decayed
WAVES_MIN = 5.0  # on a row, at the lowest frequency


@dataclass(frozen=True)
class Tool:
    """How a line is drawn."""

    down: str
    up: str
    begin: tuple[str, ...] = ()
    end: tuple[str, ...] = ()


@dataclass(frozen=True)
class PatternOptions:
    """What the user asked for."""

    axis: str = "x"
    tool: str = "pen"
    feed_mm_min: float = 1800.0
    length_mm: float = 40.0
    lines: int = 5
    spacing_mm: float = 6.0
    low_hz: float = 15.0
    high_hz: float = 80.0
    acceleration_mm_s2: float = 500.0
    depth_mm: float = 0.0
    clear_mm: float = 3.0
    plunge_mm_min: float = 300.0
    speed: float = 0.0  # S word
    start_x_mm: float = 0.0
    start_y_mm: float = 0.0

    @property
    def feed_mm_s(self) -> float:
        return self.feed_mm_min / 60.0

    @property
    def ramp_mm(self) -> float:
        """From the corner to where the feed is reached."""
        return self.feed_mm_s**2 / (2.0 * self.acceleration_mm_s2)


@dataclass(frozen=True)
class Line:
    """One row, in the pattern's own directions: `across` is the tested axis, `along` the other one."""

    hz: float  # whose waves are largest here
    feed_in_mm_min: float
    across_mm: float  # of the straight part
    run_in_mm: float  # across, before the corner


def lines_of(options: PatternOptions) -> tuple[Line, ...]:
    """The rows. Raises UserError for a pattern that shows nothing or cannot be drawn."""
    _check(options)
    found: list[Line] = []
    for index in range(options.lines):
        share = index / (options.lines - 1) if options.lines > 1 else 0.5
        hz = options.low_hz * (options.high_hz / options.low_hz) ** share
        speed = options.acceleration_mm_s2 / (2.0 * hz)
        run_in = speed**2 / options.acceleration_mm_s2 + PERIODS_BEFORE * speed / hz
        left = max(run_in, REFERENCE_MM)
        across = found[-1].across_mm + max(options.spacing_mm, left + REFERENCE_MM) if found else left
        found.append(Line(hz, speed * 60.0, across, run_in))
    return tuple(found)


def _check(options: PatternOptions) -> None:
    hz = load_settings()["shaper_hz"]
    positive = {
        "--feed": options.feed_mm_min, "--length": options.length_mm, "--acceleration": options.acceleration_mm_s2,
        "--clear": options.clear_mm, "--plunge": options.plunge_mm_min,
    }  # fmt: skip
    for name, value in positive.items():
        if not (math.isfinite(value) and value > 0.0):
            raise UserError(f"{name} {value:g}: must be more than 0")
    if not hz.min <= options.low_hz < options.high_hz <= hz.max:
        raise UserError(
            f"--from-hz {options.low_hz:g} --to-hz {options.high_hz:g}: must be {hz.min:g} to {hz.max:g} Hz, "
            "the lower one first"
        )
    if options.spacing_mm < 2.0 * REFERENCE_MM:
        raise UserError(f"--spacing {options.spacing_mm:g}: must be {2.0 * REFERENCE_MM:g} mm or more")
    if options.tool == "cut" and options.depth_mm <= 0.0:
        raise UserError("a cut needs a depth", hint="--depth 0.1")
    if options.tool != "pen" and options.speed <= 0.0:
        raise UserError(f"--tool {options.tool} needs --speed", hint="the S word: rpm, or the power of a laser")
    longest = options.feed_mm_s / options.low_hz
    if options.length_mm < WAVES_MIN * longest:
        raise UserError(
            f"--length {options.length_mm:g} is too short: a wave of {options.low_hz:g} Hz has {longest:.2f} mm",
            hint=f"--length {math.ceil(WAVES_MIN * longest)}, a lower --feed, or a higher --from-hz",
        )


def pattern(options: PatternOptions) -> str:
    """The program."""
    rows = lines_of(options)
    tool = _tool(options)
    lines = [*_header(options, rows), "G21 G90 G94 G17", *tool.begin]
    for number, row in enumerate(rows, 1):
        lines += ["", f"(line {number}: {row.hz:.0f} Hz)"]
        lines += _row(options, tool, row)
    lines += ["", *tool.end, f"G0 {_place(options, 0.0, 0.0)}", "M2"]
    return "\n".join(lines) + "\n"


def _tool(options: PatternOptions) -> Tool:
    if options.tool == "laser":
        return Tool(f"S{options.speed:g}", "S0", ("M4 S0",), ("M5",))
    up = f"G0 Z{options.clear_mm:.3f}"
    down = f"G1 Z{0.0 - options.depth_mm:.3f} F{options.plunge_mm_min:g}"
    if options.tool == "pen":
        return Tool(down, up, (up,))
    return Tool(down, up, (up, f"M3 S{options.speed:g}", "G4 P3"), ("M5",))


def _row(options: PatternOptions, tool: Tool, row: Line) -> Iterator[str]:
    """Reference line, then the line with the corner."""
    end = options.ramp_mm + options.length_mm
    reference = row.across_mm - REFERENCE_MM
    yield f"G0 {_place(options, reference, 0.0)}"
    yield tool.down
    yield f"G1 {_place(options, reference, end)} F{options.feed_mm_min:g}"
    yield tool.up
    yield f"G0 {_place(options, row.across_mm - row.run_in_mm, 0.0)}"
    yield tool.down
    yield f"G1 {_place(options, row.across_mm, 0.0)} F{row.feed_in_mm_min:.0f}"
    yield f"G1 {_place(options, row.across_mm, end)} F{options.feed_mm_min:g}"
    yield tool.up


def _place(options: PatternOptions, across_mm: float, along_mm: float) -> str:
    x, y = (across_mm, along_mm) if options.axis == "x" else (along_mm, across_mm)
    return f"X{options.start_x_mm + x:.3f} Y{options.start_y_mm + y:.3f}"


def _header(options: PatternOptions, rows: tuple[Line, ...]) -> Iterator[str]:
    axis, other = options.axis.upper(), "Y" if options.axis == "x" else "X"
    shaper = load_settings()["shaper"].number + (0 if options.axis == "x" else 1)
    feed, spacing = options.feed_mm_min, options.feed_mm_s
    highest = 2.0 * options.acceleration_mm_s2 / (2.0 * math.pi) ** 2 * 1000.0
    words = (
        f"Vibration test of the {axis} axis, by wificnc tune pattern",
        f"Before: switch the shaper of {axis} off, ${shaper}=0, and the feed override to 100 percent",
        f"Each line has a straight reference line next to it, then a line with a corner: after it {axis} vibrates,",
        f"and the tool draws waves along {other}. Look at the edges of the lines with a magnifier or a scanner.",
        "The waves are most visible on the line that fits the frequency of the frame: use that one.",
        f"Begin {options.ramp_mm:.1f} mm after the corner, where the feed is reached.",
        "Measure the distance D in mm from one crest to the Nth crest after it, as many as you can see clearly;",
        "if you can, also the heights of these two waves above the straight end of the line. Then",
        f"wificnc tune measure --axis {axis.lower()} --feed {feed:g} --waves N --distance D --first A1 --last A2",
        f"A wave of 1 mm means {spacing:.1f} Hz, 2 mm {spacing / 2.0:.1f} Hz, 0.5 mm {spacing * 2.0:.1f} Hz.",
        f"With {options.acceleration_mm_s2:g} mm/s2 the first wave is at most {highest / 20.0**2:.0f} um high at 20 Hz "
        f"and {highest / 40.0**2:.0f} um at 40 Hz,",
        f"in proportion to the acceleration: if no waves are visible, test with a higher acceleration of {axis}",
        "and give it as --acceleration.",
    )
    yield from (f"({line})" for line in _without_brackets(words))


def _without_brackets(words: tuple[str, ...]) -> Iterator[str]:
    """A comment ends at the first closing bracket."""
    yield from (line.replace("(", "[").replace(")", "]") for line in words)
