"""The picture of a job: top view, isometric view, speed over time. Needs matplotlib (extra `plot`).

How it looks is in look.py, which the page for browsers goes by, too; one scale of speed serves all three panels.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from wificnc.simulator import look
from wificnc.simulator.engraving import Pieces, pieces_from, rasterise, unit
from wificnc.simulator.job import SimResult
from wificnc.simulator.path import Floats, Path, envelope, isometric, nearness, path_from_samples, runs, simplify
from wificnc.simulator.report import DWELL_SHOWN_S, duration, error_line

INK, SOFT, FAINT = "#1f2933", "#66727f", "#dfe4ea"
TRAVEL = "#c2410c"
DPI = 150
SIZE_IN = (14.0, 9.2)
RASTER_ABOVE = 20_000  # segments: an SVG holds them as a picture
MARGIN = 1.12  # of a view around what it shows
TRAVEL_SHOWN = 2.0  # a travel larger than so many times the job is reported, not drawn
OFF_SCALE = 2.5  # rapids that are so much faster than the cuts leave the speed panel
CLOCK_STEPS_S = (10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600)

Projection = Callable[[Floats], Floats]  # of points onto the plane of a view

STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9.5,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": SOFT,
    "axes.titlecolor": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "svg.hashsalt": "wificnc",  # the same job, the same file
    "svg.fonttype": "path",
}


@dataclass(frozen=True)
class Scale:
    """What a colour means."""

    norm: Normalize
    colours: Colormap
    unit: str

    @classmethod
    def of(cls, top: float, colours: tuple[str, ...], unit: str) -> Scale:
        return cls(Normalize(0.0, top), LinearSegmentedColormap.from_list("scale", colours), unit)


@dataclass(frozen=True)
class Scene:
    """What all panels share."""

    result: SimResult
    path: Path  # as sampled
    drawn: Path  # as drawn
    low_mm: Floats
    high_mm: Floats
    travel_mm: tuple[float, float, float] | None
    speed: Scale
    engraving: Pieces | None  # of a laser: takes the place of the cuts
    at_rest_mm: Floats  # (n, 3): burnt there without motion
    cuts: Scale

    @property
    def size_mm(self) -> Floats:
        return self.high_mm - self.low_mm

    @property
    def moves(self) -> bool:
        return len(self.path.t_s) > 1

    @property
    def travel_fits_picture(self) -> bool:
        if self.travel_mm is None:
            return False
        return bool(max(self.travel_mm[:2]) <= TRAVEL_SHOWN * max(float(self.size_mm[:2].max()), 1e-3))


def draw_job(result: SimResult, file_format: str, laser_w: float | None = None) -> bytes:
    """The picture as the bytes of a png or svg file. laser_w: optical power, for energies in J."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE_IN, dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)
        scene = _scene(result, laser_w)
        grid = figure.add_gridspec(
            2, 3, width_ratios=(1, 1, 0.022), height_ratios=(2.6, 1), left=0.06, right=0.94, top=0.865, bottom=0.065
        )
        grid.update(wspace=0.1, hspace=0.2)
        _titles(figure, scene)
        _top_view(figure.add_subplot(grid[0, 0]), scene)
        _iso_view(figure.add_subplot(grid[0, 1]), scene)
        _colour_bar(figure, figure.add_subplot(grid[0, 2]), scene)
        _speed_panel(figure.add_subplot(grid[1, :]), scene)
        out = io.BytesIO()
        figure.savefig(out, format=file_format, metadata={"Date": None} if file_format == "svg" else None)
        return out.getvalue()


def _scene(result: SimResult, laser_w: float | None) -> Scene:
    path = path_from_samples(result.samples)
    low, high = (np.array([*box, 0.0, 0.0][:3]) for box in (result.box_min_mm, result.box_max_mm))
    tolerance_mm = max(float((high - low).max()), 1e-3) / look.ACCURACY_PARTS
    x, y, z = result.travel_mm[:3]
    pieces, at_rest = pieces_from(result.engraving.pieces if result.engraving else b"", laser_w)
    engraving = pieces if len(pieces.length_mm) else None
    speed = Scale.of(path.top_speed_mm_min, look.SPEED_COLOURS, "mm/min")
    return Scene(
        result=result,
        path=path,
        drawn=simplify(path, tolerance_mm),
        low_mm=low,
        high_mm=high,
        travel_mm=(x, y, z or 0.0) if x and y else None,
        speed=speed,
        engraving=engraving,
        at_rest_mm=at_rest,
        cuts=Scale.of(engraving.black, look.ENGRAVING_COLOURS, unit(laser_w)) if engraving else speed,
    )


# ---- words ----


def _titles(figure: Figure, scene: Scene) -> None:
    result = scene.result
    name = result.file.replace("\\", "/").rsplit("/", 1)[-1]
    figure.text(0.06, 0.955, _escape(name), fontsize=17, weight="bold", va="center")
    facts = [duration(result.job_time_s), _size(scene.size_mm), f"{result.lines:,} lines"]
    figure.text(0.06, 0.918, "   ·   ".join(facts), fontsize=11, color=SOFT, va="center")
    if result.errors:
        more = f"  (and {len(result.errors) - 1} more)" if len(result.errors) > 1 else ""
        said = error_line(name, result.errors[0]) + more
        figure.text(0.94, 0.955, _escape(said), fontsize=11, color=look.END, weight="bold", ha="right", va="center")
    parts = [f"cutting {duration(result.cutting_time_s)}", f"rapids {duration(result.rapid_time_s)}"]
    if result.dwell_time_s >= DWELL_SHOWN_S:
        parts.append(f"dwell {duration(result.dwell_time_s)}")
    figure.text(0.94, 0.918, "   ·   ".join(parts), fontsize=11, color=SOFT, ha="right", va="center")


def _size(size_mm: Floats) -> str:
    return " × ".join(f"{size:.2f}" for size in size_mm) + " mm"


def _escape(text: str) -> str:
    """Dollar signs would begin mathematics."""
    return text.replace("$", r"\$")


# ---- lines ----


def _draw_path(axes: Any, scene: Scene, project: Projection, order: Floats | None = None) -> None:
    """In a view that has its frame. order: cuts with small numbers are drawn first."""
    path, points = scene.drawn, project(scene.drawn.xyz_mm)
    dashes = [points[a:b] for a, b in runs(path.rapid)]
    axes.add_collection(
        LineCollection(
            dashes, colors=look.RAPID, linewidths=look.RAPID_WIDTH, linestyles=(0, look.RAPID_DASHES), zorder=2
        ),
        autolim=False,
    )
    if scene.engraving:
        _draw_engraving(axes, scene, scene.engraving, project)
        return
    cut = np.flatnonzero(~path.rapid[1:]) + 1
    if order is not None:
        cut = cut[np.argsort(order[cut], kind="stable")]
    _draw_lines(axes, scene.cuts, points[cut - 1], points[cut], path.speed_mm_min[cut])


def _draw_lines(axes: Any, scale: Scale, begins: Floats, ends: Floats, values: Floats) -> None:
    lines = LineCollection(
        list(np.stack([begins, ends], axis=1)), cmap=scale.colours, norm=scale.norm, capstyle="round", zorder=3
    )
    lines.set_array(values)
    lines.set_linewidth(_line_width(len(values)))
    lines.set_rasterized(len(values) > RASTER_ABOVE)
    axes.add_collection(lines, autolim=False)


def _draw_engraving(axes: Any, scene: Scene, pieces: Pieces, project: Projection) -> None:
    """Few pieces as lines, the darkest on top; many as pixels of their mean energy."""
    begins, ends = project(pieces.from_mm), project(pieces.to_mm)
    if len(begins) > look.ENGRAVING_DENSE:
        _draw_pixels(axes, scene.cuts, pieces, begins, ends)
    else:
        order = np.argsort(pieces.energy_by_mm, kind="stable")
        _draw_lines(axes, scene.cuts, begins[order], ends[order], pieces.energy_by_mm[order])
    if len(scene.at_rest_mm):
        axes.plot(*project(scene.at_rest_mm).T, "x", ms=7, mew=1.6, color=look.END, zorder=8, label="burnt at rest")


def _draw_pixels(axes: Any, scale: Scale, pieces: Pieces, begins: Floats, ends: Floats) -> None:
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    figure_px = axes.get_window_extent().width
    size_mm = np.ptp(np.concatenate([begins, ends]), axis=0)
    apart_px = look.ENGRAVING_COVER * size_mm.prod() / pieces.length_mm.sum() * figure_px / (high[0] - low[0])
    width = round(figure_px / float(np.clip(apart_px, *look.ENGRAVING_WIDTHS)))
    grey = rasterise(pieces, begins, ends, low, high, width)
    axes.imshow(
        grey, cmap=scale.colours, norm=scale.norm, origin="lower", extent=(low[0], high[0], low[1], high[1]),
        interpolation="nearest", zorder=3,
    )  # fmt: skip


def _line_width(segments: int) -> float:
    sizes, widths = np.array(look.CUT_WIDTHS).T
    return float(np.interp(np.log10(max(segments, 1)), sizes, widths))


def _mark_ends(axes: Any, points: Floats) -> None:
    if len(points) == 0:
        points = np.zeros((1, 2))
    axes.plot(*points[0], "o", ms=8, mfc=look.START, mec="white", mew=1.2, zorder=7, label="start")
    axes.plot(*points[-1], "s", ms=8, mfc=look.END, mec="white", mew=1.2, zorder=6, label="end")


def _frame(axes: Any, low: Floats, high: Floats) -> None:
    """Equal scales; the view is filled, whatever the shape of the job."""
    middle, half = (low + high) / 2.0, np.maximum((high - low) / 2.0, 1e-9)
    if half.max() < 1e-6:
        half[:] = 1.0
    panel = axes.get_window_extent()
    scale = (half * MARGIN / (panel.width, panel.height)).max()
    half = scale * np.array([panel.width, panel.height])
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])


# ---- panels ----


def _top_view(axes: Any, scene: Scene) -> None:
    low, high = scene.low_mm[:2], scene.high_mm[:2]
    axes.add_patch(
        Rectangle((low[0], low[1]), *(high - low), fill=False, ec=look.EXTENT, lw=look.EXTENT_WIDTH, ls=":", zorder=4)
    )
    view_high = high
    if scene.travel_mm and scene.travel_fits_picture:
        travel = np.array(scene.travel_mm[:2])
        axes.add_patch(Rectangle((low[0], low[1]), *travel, fill=False, ec=TRAVEL, lw=1.0, ls=(0, (8, 4)), zorder=1))
        view_high = np.maximum(high, low + travel)
    _frame(axes, low, view_high)
    _draw_path(axes, scene, lambda xyz_mm: xyz_mm[:, :2])
    if not scene.engraving:
        _plunges(axes, scene)
    _mark_ends(axes, scene.path.xyz_mm[[0, -1], :2] if scene.moves else np.zeros((0, 2)))
    axes.set_title("top view", loc="left", fontsize=10.5, pad=8)
    axes.set_xlabel("X mm", labelpad=2)
    axes.set_ylabel("Y mm", labelpad=2)
    axes.grid(color=FAINT, lw=0.6, zorder=0)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    _legend(axes, scene)
    if not scene.moves:
        axes.text(0.5, 0.62, "nothing moves", transform=axes.transAxes, ha="center", fontsize=13, color=SOFT)


def _plunges(axes: Any, scene: Scene) -> None:
    """Cuts straight up or down: from above they are dots (drilled holes)."""
    path = scene.drawn
    step = np.abs(np.diff(path.xyz_mm, axis=0))
    flat = np.hypot(step[:, 0], step[:, 1])
    upright = np.flatnonzero((step[:, 2] > look.PLUNGE_STEEPNESS * flat) & ~path.rapid[1:]) + 1
    holes, first = np.unique(np.round(path.xyz_mm[upright, :2], 3), axis=0, return_index=True)
    speeds = path.speed_mm_min[upright[first]]
    axes.scatter(*holes.T, s=9.0, c=speeds, cmap=scene.speed.colours, norm=scene.speed.norm, lw=0, zorder=3)


def _legend(axes: Any, scene: Scene) -> None:
    axes.plot([], [], color=look.RAPID, lw=0.9, ls=(0, look.RAPID_DASHES), label="rapid")
    axes.plot([], [], color=look.EXTENT, lw=look.EXTENT_WIDTH, ls=":", label="extent")
    if scene.travel_mm:
        travel = " × ".join(f"{mm:g}" for mm in scene.travel_mm[:2])
        shown = scene.travel_fits_picture
        axes.plot([], [], color=TRAVEL, lw=1.0, ls=(0, (8, 4)) if shown else "none", label=f"travel {travel}")
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, frameon=False, fontsize=8.5, labelcolor=SOFT,
        handlelength=1.6, columnspacing=1.2, borderaxespad=0.3, handletextpad=0.5,
    )  # fmt: skip


CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))
EDGES = [(a, b) for a, b in product(range(8), repeat=2) if a < b and np.abs(CORNERS[a] - CORNERS[b]).sum() == 1]


def _iso_view(axes: Any, scene: Scene) -> None:
    corners = isometric(scene.low_mm + CORNERS * scene.size_mm)
    _frame(axes, corners.min(axis=0), corners.max(axis=0))
    _draw_path(axes, scene, isometric, nearness(scene.drawn.xyz_mm))
    axes.add_collection(
        LineCollection(
            [corners[list(edge)] for edge in EDGES],
            colors=look.EXTENT,
            linewidths=look.EXTENT_WIDTH,
            linestyles=":",
            zorder=1,
        ),
        autolim=False,
    )
    _mark_ends(axes, isometric(scene.path.xyz_mm[[0, -1]]) if scene.moves else np.zeros((0, 2)))
    _triad(axes)
    axes.set_title("isometric", loc="left", fontsize=10.5, pad=8)
    axes.set_xticks([])
    axes.set_yticks([])


def _triad(axes: Any) -> None:
    """Which way X, Y and Z go, in the corner."""
    directions = isometric(np.eye(3))
    for letter, (right, up) in zip("XYZ", directions, strict=True):
        tip = (0.075 * right, 0.075 * up)
        origin = (0.045, 0.115)
        axes.annotate(
            "", (origin[0] + tip[0], origin[1] + tip[1]), origin, "axes fraction", "axes fraction",
            arrowprops={"arrowstyle": "-|>", "color": SOFT, "lw": 1.0, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        at = (origin[0] + 1.3 * tip[0], origin[1] + 1.3 * tip[1])
        axes.text(*at, letter, transform=axes.transAxes, color=SOFT, fontsize=8.5, ha="center", va="center")


def _colour_bar(figure: Figure, axes: Any, scene: Scene) -> None:
    if scene.path.rapid.all():  # no cuts, no colours
        axes.set_axis_off()
        return
    mappable = matplotlib.cm.ScalarMappable(norm=scene.cuts.norm, cmap=scene.cuts.colours)
    bar = figure.colorbar(mappable, cax=axes)
    bar.outline.set_visible(False)
    axes.tick_params(length=0)
    axes.set_title(scene.cuts.unit, loc="right" if scene.engraving else "left", fontsize=8.5, color=SOFT, pad=8)


def _speed_panel(axes: Any, scene: Scene) -> None:
    path = envelope(scene.path)
    points = np.stack([path.t_s, path.speed_mm_min], axis=1)
    axes.fill_between(path.t_s, path.speed_mm_min, color=FAINT, lw=0, alpha=0.55, zorder=1)
    _draw_speed(axes, scene, points, path)
    fastest = max(float(path.speed_mm_min.max()), 1.0) if len(points) else 1.0
    top, title = fastest * 1.06, "speed along the path, mm/min, mean of 10 ms"
    if fastest > OFF_SCALE * path.top_speed_mm_min:
        top = path.top_speed_mm_min * OFF_SCALE
        title += f"   (rapids are off the scale, up to {fastest:,.0f})"
    axes.set_ylim(0.0, top)
    axes.set_title(title, loc="left", fontsize=10.5, pad=6)
    axes.set_title(_accelerations(scene.result), loc="right", fontsize=8.5, color=SOFT, pad=6)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    _time_axis(axes, scene.result.job_time_s)
    axes.grid(axis="y", color=FAINT, lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)


def _accelerations(result: SimResult) -> str:
    moving = [i for i in range(len(result.axes)) if result.steps_per_axis[i]]
    figures = (
        f"{result.axes[i]} {result.max_accel_mm_s2[i]:,.0f} in {1000 * result.accel_window_s[i]:.0f} ms" for i in moving
    )
    return "greatest acceleration, mm/s²: " + ", ".join(figures) if moving else ""


def _draw_speed(axes: Any, scene: Scene, points: Floats, path: Path) -> None:
    rapid = path.rapid.copy()
    rapid[1:] |= path.rapid[:-1]  # the way down from a rapid is grey too
    grey = [points[a:b] for a, b in runs(rapid)]
    axes.add_collection(LineCollection(grey, colors=look.RAPID, linewidths=0.8, zorder=2), autolim=False)
    cut = np.flatnonzero(~rapid[1:]) + 1
    segments = list(np.stack([points[cut - 1], points[cut]], axis=1))
    lines = LineCollection(segments, cmap=scene.speed.colours, norm=scene.speed.norm, zorder=3)
    lines.set_array(path.speed_mm_min[cut])
    lines.set_linewidth(1.1)
    lines.set_capstyle("round")
    axes.add_collection(lines, autolim=False)


def _time_axis(axes: Any, job_s: float) -> None:
    """Seconds, min:s or h:min, with ticks where a clock has them."""
    axes.set_xlim(0.0, job_s or 1.0)
    if job_s < 120.0:
        axes.xaxis.set_major_locator(MaxNLocator(12))
        axes.set_xlabel("s", labelpad=2)
        return
    step_s = next((step for step in CLOCK_STEPS_S if step * 14 >= job_s), CLOCK_STEPS_S[-1])
    while step_s * 14 < job_s:
        step_s *= 2
    unit = 60 if job_s < 7200.0 else 3600

    def clock(t_s: float, _: int) -> str:
        whole, rest = divmod(round(t_s), unit)
        return f"{whole}:{rest * 60 // unit:02d}"

    axes.xaxis.set_major_locator(MultipleLocator(step_s))
    axes.xaxis.set_major_formatter(FuncFormatter(clock))
    axes.set_xlabel("min:s" if unit == 60 else "h:min", labelpad=2)
