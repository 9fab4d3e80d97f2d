"""How the path of a job is drawn, by `wificnc sim --plot` and by the page (`web/src/job/scene.ts`): the one home of it.

Cuts have the colour of their speed, rapids are thin dashes, straight plunges are dots when seen from above; a dotted
box is the extent, a circle the start, a square the end.
"""

from __future__ import annotations

import math
from typing import Any

# From 0 to the fastest cut: matplotlib's plasma, which grows lighter all the way and keeps its order for the
# colour-blind, without its lightest part on white, without its darkest on black.
SPEED_COLOURS = ("#0d0887", "#44039e", "#7100a8", "#99159f", "#bb3488", "#d5546e", "#eb7556", "#f9983e", "#fdc229")
SPEED_COLOURS_DARK = ("#7201a8", "#9613a1", "#b52f8c", "#ce4b75", "#e3685f", "#f3874a", "#fca934", "#fcd025", "#f0f921")
SPEED_LEVELS = 64  # in the picture

RAPID, RAPID_DARK = "#8b95a1", "#66727f"
RAPID_WIDTH, RAPID_DASHES = 0.7, (5.0, 3.0)
EXTENT, EXTENT_DARK, EXTENT_WIDTH = "#3b4754", "#9fb2c0", 0.8
START, END = "#15803d", "#b91c1c"

# What a laser burnt, from little energy by length to much: as it is on wood, and on black the other way round.
ENGRAVING_COLOURS = ("#e4e4e4", "#000000")
ENGRAVING_COLOURS_DARK = ("#3a3f45", "#ffffff")
ENGRAVING_QUANTILE = 0.95  # so much of the length gets no more than the typical energy ...
ENGRAVING_BLACK = 1.5  # ... and black is so many times that
ENGRAVING_DENSE = 20_000  # more pieces are dense
# Dense engraving is drawn so much wider than its lines are apart, and at least and at most so many pixels, so that
# hatching becomes an area.
ENGRAVING_COVER, ENGRAVING_WIDTHS = 1.25, (1.0, 4.0)

# Width of a cut against the decimal logarithm of the number of segments: dense jobs want finer lines.
CUT_WIDTHS = ((2.5, 1.7), (5.0, 0.6))
PLUNGE_STEEPNESS = 20.0  # a cut that goes so much more down than sideways is a dot from above
SAMPLE_MS = 1.0  # of the path, which is seen at such steps of time
ACCURACY_PARTS = 900 * 8  # the drawn path is true to such a part of its extent: an eighth of a pixel of a view

# Isometric: X to the lower right, Y to the upper right, all axes in one scale.
ISOMETRIC_TURN, ISOMETRIC_TILT = -math.pi / 4.0, math.asin(1.0 / math.sqrt(3.0))


def look_table() -> dict[str, Any]:
    """What the page is built with."""
    return {
        "speed": {"light": SPEED_COLOURS, "dark": SPEED_COLOURS_DARK, "levels": SPEED_LEVELS},
        "rapid": {"light": RAPID, "dark": RAPID_DARK, "width": RAPID_WIDTH, "dashes": RAPID_DASHES},
        "extent": {"light": EXTENT, "dark": EXTENT_DARK, "width": EXTENT_WIDTH},
        "start": START,
        "end": END,
        "engraving": {
            "light": ENGRAVING_COLOURS,
            "dark": ENGRAVING_COLOURS_DARK,
            "quantile": ENGRAVING_QUANTILE,
            "black": ENGRAVING_BLACK,
            "dense": ENGRAVING_DENSE,
            "cover": ENGRAVING_COVER,
            "widths": ENGRAVING_WIDTHS,
        },
        "cut_widths": CUT_WIDTHS,
        "plunge_steepness": PLUNGE_STEEPNESS,
        "sample_ms": SAMPLE_MS,
        "accuracy_parts": ACCURACY_PARTS,
        "isometric": {"turn": ISOMETRIC_TURN, "tilt": ISOMETRIC_TILT},
    }
