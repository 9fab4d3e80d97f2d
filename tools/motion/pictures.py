"""The pictures of docs/motion.md, drawn from what the code does: `make pictures`.

Paths and speeds are those of step traces at 5000 steps/mm, where a step is 0.2 um; the sector is that of
core/motion/reduce.c. With a folder as argument they are drawn there.
"""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from bench.jobs import relief
from bench.measure import BUILD, ROOT, build_driver
from bench.steps import Steps, read_steps
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from motion.reducer import Reducer

Floats = NDArray[np.float64]

IMAGES = ROOT / "docs" / "images"
STEPS_PER_MM, RATE_MM_MIN, ACCEL_MM_S2, TOLERANCE_MM = 5000, 5000, 500, 0.01
REDUCE_MM = 0.3 * TOLERANCE_MM
_AXES = ((100, STEPS_PER_MM), (110, RATE_MM_MIN), (120, ACCEL_MM_S2))
SETTINGS = (
    *(f"${base + axis}={value}" for base, value in _AXES for axis in range(3)),
    f"$11={TOLERANCE_MM}",
    "$12=0.002",
)
TIMER_HZ = 10e6  # of tools/bench/drive.c
WINDOW_S = 0.004  # two segments: shorter ones see the corners between segments

INK, SOFT, FAINT, TUBE = "#1f2933", "#66727f", "#dfe4ea", "#e8eef7"
PATH, LIMIT = "#b91c1c", "#c2410c"
AXIS_COLOURS = ("#1d4ed8", "#15803d", "#b45309")
PATH_DATA = re.compile(r'\bd="[^"]*"')
LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}(?:e-\d+)?")
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9.5,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": SOFT,
    "axes.titlecolor": INK,
    "axes.titlesize": 10,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "legend.frameon": False,
    "svg.hashsalt": "wificnc",
    "svg.fonttype": "path",
}


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    for name in PICTURES:
        (folder / f"{name}.svg").write_text(svg(name), encoding="utf-8")
        print(folder / f"{name}.svg")


def svg(name: str) -> str:
    """A picture as it is drawn now."""
    text = io.StringIO()
    with matplotlib.rc_context(STYLE):
        figure = PICTURES[name]()
        FigureCanvasSVG(figure)
        figure.savefig(text, format="svg", metadata={"Date": None})
    compact = PATH_DATA.sub(lambda match: one_line(match[0]), text.getvalue())
    return "\n".join(line.rstrip() for line in compact.splitlines()) + "\n"


def one_line(path_data: str) -> str:
    """In hundredths of a pt: matplotlib has a line for each point, with six decimals."""
    short = LONG_NUMBER.sub(lambda match: f"{round(float(match[0]), 2):g}", path_data)
    return " ".join(short.split()).replace(' "', '"')


def run(program: str, *settings: str) -> Steps:
    """Step events of a program."""
    driver = build_driver()
    folder = BUILD / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    job, trace = folder / "job.nc", folder / "trace"
    job.write_text(program)
    argv = [str(driver), "-t", str(trace), "3", str(job), *SETTINGS, *settings]
    done = subprocess.run(argv, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["errors"] == 0
    steps = read_steps(trace, TIMER_HZ, np.full(3, float(STEPS_PER_MM)), len(SETTINGS) + len(settings))
    trace.unlink()
    return steps


def derivatives(steps: Steps, count: int) -> list[tuple[Floats, Floats]]:
    """Time and the derivatives of X, Y, Z up to this one, by box differences."""
    t = steps.t_s - steps.t_s[0]
    grid = np.arange(-2 * WINDOW_S, t[-1] + 2 * WINDOW_S, WINDOW_S / 6)
    q = np.stack([np.interp(grid, t, steps.at_mm[:, axis]) for axis in range(3)], axis=1)
    found = []
    for _ in range(count):
        q = (q[6:] - q[:-6]) / WINDOW_S
        grid = grid[3:-3]
        found.append((grid, q))
    return found


def bare(axes: Axes) -> None:
    axes.grid(True, color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


# --- reduce ---


def draw_reduce() -> Figure:
    """Points of a noisy chord, and what each leaves of the directions that a chord may have."""
    figure = Figure(figsize=(9.5, 3.3), layout="constrained")
    axes = figure.subplots()
    points = [(0.012, 0.0004), (0.022, -0.0008), (0.034, 0.0017), (0.046, 0.0008), (0.06, 0.0036), (0.072, 0.0135)]
    reducer = Reducer((0.0, 0.0))
    for number, point in enumerate(points):
        taken = reducer.accepts(point, REDUCE_MM)
        colour = INK if taken else PATH
        axes.add_patch(Circle(point, REDUCE_MM, facecolor=TUBE, edgecolor=colour, linewidth=0.8, alpha=0.9))
        axes.plot(*point, "o", markersize=3.5, color=colour)
        axes.annotate(str(number + 1), point, (4, 4), textcoords="offset points", color=colour)
        if taken and number in (0, 2, 4):
            _sector(axes, reducer, 0.078, 0.10 + 0.10 * number)
    axes.plot(0, 0, "s", markersize=5, color=INK)
    axes.annotate("anchor", (0, 0), (0, -14), textcoords="offset points", ha="center")
    axes.plot(*zip((0, 0), points[4], strict=True), color=INK, linewidth=1.4)
    axes.annotate(
        "6 lies outside of the directions that 1 to 5 left:\nthe chord ends at 5, and 6 begins the next",
        points[5],
        (-26, -2),
        textcoords="offset points",
        ha="right",
        color=PATH,
    )
    axes.set(xlim=(-0.004, 0.0815), ylim=(-0.0075, 0.0185), xlabel="mm", aspect="equal")
    axes.set_title("Directions allowed after points 1, 3 and 5 (shaded, darker each time); circles: 0.3 $\\epsilon$")
    bare(axes)
    return figure


def _sector(axes: Axes, reducer: Reducer, reach_mm: float, strength: float) -> None:
    angle = np.arctan2(reducer.middle[1], reducer.middle[0])
    half = np.arcsin(min(1.0, reducer.radius))
    ends = [(reach_mm * np.cos(angle + by), reach_mm * np.sin(angle + by)) for by in (-half, half)]
    axes.add_patch(Polygon([(0, 0), *ends], closed=True, facecolor=AXIS_COLOURS[0], alpha=0.35 * strength, linewidth=0))


# --- corners and curves ---


def draw_corners() -> Figure:
    """Programmed path, its tube, and the steps."""
    figure = Figure(figsize=(9.5, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    _path(left, [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)], "Corner of 90 degrees")
    left.set(xlim=(3.90, 4.035), ylim=(-0.035, 0.10))
    noisy = np.random.default_rng(5)
    angles = np.arange(0, 1.5, 0.1)
    curve = [(0.8 * np.sin(a), 0.8 - 0.8 * np.cos(a)) for a in angles] + noisy.normal(0, 0.002, (len(angles), 2))
    _path(right, [(0.0, 0.0), *map(tuple, curve[1:])], "A curve in noisy chords of 0.08 mm")
    right.set(xlim=(0.42, 0.64), ylim=(0.10, 0.32))
    return figure


def _path(axes: Axes, points: list[Any], title: str) -> None:
    words = "".join(f"X{x:.4f}Y{y:.4f}\n" for x, y in points[1:])
    steps = run(f"G21G90G1F5000\n{words}")
    vertices = np.round(np.array(points), 4)
    for begin, end in pairwise(vertices):
        across = np.array([-(end - begin)[1], (end - begin)[0]]) / np.linalg.norm(end - begin) * TOLERANCE_MM
        box = [begin + across, end + across, end - across, begin - across]
        axes.add_patch(Polygon(box, closed=True, facecolor=TUBE, linewidth=0))
    for vertex in vertices:
        axes.add_patch(Circle(tuple(vertex), TOLERANCE_MM, facecolor=TUBE, linewidth=0))
    axes.plot(vertices[:, 0], vertices[:, 1], "o-", color=SOFT, linewidth=0.9, markersize=3, label="programmed")
    shown = steps.at_mm[:: max(1, len(steps.at_mm) // 4000)]
    axes.plot(shown[:, 0], shown[:, 1], color=PATH, linewidth=1.5, label="steps")
    axes.set(aspect="equal", xlabel="mm", title=title + f"; tube of {TOLERANCE_MM} mm")
    axes.legend(loc="upper left")
    bare(axes)


# --- timing ---


def draw_timing() -> Figure:
    """Speed along the path and the acceleration of each axis, over a wavy surface."""
    lines = list(relief())[:203]
    steps = run("G21G90\n" + "\n".join(lines) + "\n")
    speed, accel = derivatives(steps, 2)
    figure = Figure(figsize=(9.5, 4.8), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.3))
    top.plot(speed[0], np.linalg.norm(speed[1], axis=1), color=INK, linewidth=1.2)
    top.axhline(4000 / 60, color=LIMIT, linewidth=0.8, linestyle="--")
    top.set(ylabel="mm/s", title="Speed along the path; dashed: the feed")
    for axis, colour in enumerate(AXIS_COLOURS):
        bottom.plot(accel[0], accel[1][:, axis], color=colour, linewidth=1.0, label="XYZ"[axis])
    for limit in (-ACCEL_MM_S2, ACCEL_MM_S2):
        bottom.axhline(limit, color=LIMIT, linewidth=0.8, linestyle="--")
    bottom.set(ylim=(-760, 620), xlim=(0, speed[0][-1]), ylabel="mm/s²", xlabel="s")
    bottom.set(title="Acceleration of each axis; dashed: its limit")
    bottom.legend(loc="lower left", ncols=3)
    for axes in (top, bottom):
        bare(axes)
    return figure


# --- jerk ---


def draw_jerk() -> Figure:
    """One line, without and with limited jerk."""
    figure = Figure(figsize=(9.5, 5.2), layout="constrained")
    rows = figure.subplots(3, 1, sharex=True)
    for jerk, colour in ((0, SOFT), (100_000, AXIS_COLOURS[0]), (20_000, PATH)):
        found = derivatives(run("G21G90G1F5000X12\n", f"$40={jerk}"), 3)
        for axes, (t, q) in zip(rows, found, strict=True):
            axes.plot(t, q[:, 0], color=colour, linewidth=1.2, label=f"$40 = {jerk}".replace("$", "\\$"))
    for axes, name in zip(rows, ("speed, mm/s", "acceleration, mm/s²", "jerk, mm/s³"), strict=True):
        axes.set_ylabel(name)
        bare(axes)
    rows[2].set(xlabel="s", ylim=(-150_000, 150_000))
    rows[0].legend(loc="upper right")
    rows[0].set_title("A line of 12 mm at 5000 mm/min (differences over 4 ms)")
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    "motion-reduce": draw_reduce,
    "motion-corner": draw_corners,
    "motion-timing": draw_timing,
    "motion-jerk": draw_jerk,
}

if __name__ == "__main__":
    main()
