"""The picture of a prediction: the vibration at the worst stop before and after, and what each shaper leaves over the
frequency. Needs matplotlib (extra `plot`)."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from wificnc.simulator.plot import DPI, FAINT, INK, SOFT, STYLE
from wificnc.tune.mass import response_mm, sample_s
from wificnc.tune.predict import AxisPrediction
from wificnc.tune.shapers import OFF, SHAPERS, Shaper, impulses

WIDTH_IN, TITLE_IN, AXIS_IN = 14.0, 0.9, 3.6
PERIODS_BEFORE, PERIODS_AFTER = 3.0, 11.0  # of the stop, in the picture
SETTLED = math.log(1000.0)  # decay of what came before the picture's begin
SETTLED_MAX_S = 3.0
FREQUENCIES = (0.5, 1.5)  # times that of the vibration
# Okabe and Ito's colours, which the colour-blind tell apart.
COLOURS = {"off": "#9aa4ae", "ZV": "#d55e00", "MZV": "#0072b2", "EI": "#009e73", "2-hump EI": "#cc79a7"}


def draw(name: str, axes: Sequence[AxisPrediction], file_format: str) -> bytes:
    """The picture as the bytes of a png or svg file."""
    height = TITLE_IN + AXIS_IN * len(axes)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)
        figure.text(0.06, 1.0 - 0.45 / height, name.replace("$", r"\$"), fontsize=17, weight="bold", va="center")
        grid = figure.add_gridspec(
            len(axes), 2, width_ratios=(1.7, 1), left=0.06, right=0.97, top=1.0 - 1.15 / height, bottom=0.6 / height,
            hspace=0.45, wspace=0.16,
        )  # fmt: skip
        for row, axis in enumerate(axes):
            _draw_stop(figure.add_subplot(grid[row, 0]), axis, row == len(axes) - 1)
            _draw_residuals(figure.add_subplot(grid[row, 1]), axis, row == len(axes) - 1)
        out = io.BytesIO()
        figure.savefig(out, format=file_format, metadata={"Date": None} if file_format == "svg" else None)
        return out.getvalue()


def _draw_stop(panel: Any, axis: AxisPrediction, last: bool) -> None:
    """The mass relative to its axis, without a shaper and with the recommended one."""
    off = next(row for row in axis.rows if row.shaper is OFF)
    index = int(np.searchsorted(axis.motion.rest_from_s, off.vibration.worst_s, side="right")) - 1
    stop_s = float(axis.motion.rest_from_s[index])
    period = 1.0 / axis.mode.hz
    omega = 2.0 * math.pi * axis.mode.hz
    before_s = SETTLED_MAX_S if axis.mode.damping == 0.0 else min(SETTLED_MAX_S, SETTLED / (axis.mode.damping * omega))
    t_s = np.arange(
        stop_s - PERIODS_BEFORE * period - before_s, stop_s + PERIODS_AFTER * period, sample_s(axis.mode) / 2.0
    )
    shown = t_s >= stop_s - PERIODS_BEFORE * period
    drawn = (OFF, axis.best) if axis.best is not OFF else (OFF,)
    for shaper in drawn:
        shape = impulses(shaper, axis.mode.hz, axis.mode.damping)
        y_um = 1e3 * response_mm(axis.motion, shape, axis.mode, t_s)
        label = "without a shaper" if shaper is OFF else f"with {shaper.name}"
        panel.plot(
            1e3 * (t_s[shown] - stop_s), y_um[shown], color=COLOURS[shaper.name], label=label, **_line(shaper, axis)
        )
        panel.axvline(1e3 * shape.duration_s, color=COLOURS[shaper.name], linewidth=0.8, linestyle=(0, (3, 3)))
    words = (f"{axis.mode.hz:.1f} Hz, damping {axis.mode.damping:.3f}", f"worst stop, at {stop_s:.2f} s")
    title = "   ·   ".join((axis.axis.upper(), *words))
    _frame(panel, title, "ms after the program's stop; dashed: the axis rests" if last else "", "vibration, µm")
    panel.legend(loc="upper right", frameon=False, labelcolor=INK)


def _draw_residuals(panel: Any, axis: AxisPrediction, last: bool) -> None:
    hz = axis.mode.hz * np.linspace(*FREQUENCIES, 301)
    for shaper in SHAPERS[1:]:
        shape = impulses(shaper, axis.mode.hz, axis.mode.damping)
        left = [shape.residual(float(f), axis.mode.damping) for f in hz]
        panel.plot(hz, left, color=COLOURS[shaper.name], label=shaper.name, **_line(shaper, axis))
    panel.set_ylim(0.0, 1.0)
    panel.set_xlim(hz[0], hz[-1])
    panel.axvline(axis.mode.hz, color=SOFT, linewidth=0.8, linestyle=(0, (3, 3)))
    panel.yaxis.set_major_formatter(PercentFormatter(1.0))
    _frame(panel, "vibration that is left, if the frequency is another one", "Hz" if last else "", "")
    panel.legend(loc="upper center", frameon=False, labelcolor=INK, ncols=2)


def _line(shaper: Shaper, axis: AxisPrediction) -> dict[str, Any]:
    """The recommended one is thicker, and above the others."""
    chosen = shaper is axis.best
    return {"linewidth": 2.0 if chosen else 1.2, "zorder": 4 if chosen else 3}


def _frame(panel: Any, title: str, below: str, left: str) -> None:
    panel.set_title(title, loc="left", fontsize=11, color=INK)
    panel.set_xlabel(below)
    panel.set_ylabel(left)
    panel.grid(color=FAINT, linewidth=0.6)
    panel.set_axisbelow(True)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
