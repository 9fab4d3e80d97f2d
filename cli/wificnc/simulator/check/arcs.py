"""How a refused arc can be corrected. Pure."""

from __future__ import annotations

from math import hypot

from wificnc.simulator.library import SurveyArc

PLANE_WORDS = ("IJ", "KI", "JK")  # of the first and second axis of G17, G18, G19
DECIMALS = 4
SPIRAL_PART = 0.5  # of the radius: $41 never bends an arc further


def arc_hint(arc: SurveyArc) -> str:
    """What to write instead."""
    chord_mm = hypot(*arc.way_mm)
    if arc.by_radius:
        return _radius_hint(arc, chord_mm)
    start_mm, end_mm = _radii(arc)
    if start_mm == 0:
        return "the arc centre is the start point: give I, J or K of the centre"
    differ_mm = abs(start_mm - end_mm)
    mended = _mended_center(arc, chord_mm)
    words = " ".join(
        f"{letter}{value:.{DECIMALS}f}" for letter, value in zip(PLANE_WORDS[arc.plane], mended, strict=True)
    )
    hint = f"the radii of start and end differ by {differ_mm:.4f} mm; the nearest circle through both has {words}"
    if differ_mm <= SPIRAL_PART * start_mm:
        hint += f", and $41={_above(differ_mm)} lets the controller bend it"
    return hint


def _radius_hint(arc: SurveyArc, chord_mm: float) -> str:
    if chord_mm == 0:
        return "start and end are the same point, so R is ambiguous: a full circle needs I, J or K"
    least = _above(chord_mm / 2 / arc.unit_mm)
    return f"the ends are {chord_mm:.4f} mm apart: R{least} is the smallest that reaches"


def _radii(arc: SurveyArc) -> tuple[float, float]:
    first, second = arc.center_mm
    return hypot(first, second), hypot(arc.way_mm[0] - first, arc.way_mm[1] - second)


def _mended_center(arc: SurveyArc, chord_mm: float) -> tuple[float, float]:
    """The words of the programmed centre moved square onto the perpendicular bisector of the chord."""
    if chord_mm == 0:
        return arc.word_mm[0] / arc.unit_mm, arc.word_mm[1] / arc.unit_mm
    unit = (arc.way_mm[0] / chord_mm, arc.way_mm[1] / chord_mm)
    beside_mm = chord_mm / 2 - (arc.center_mm[0] * unit[0] + arc.center_mm[1] * unit[1])
    first, second = (arc.word_mm[i] + beside_mm * unit[i] for i in range(2))
    return first / arc.unit_mm, second / arc.unit_mm


def _above(value: float) -> str:
    """Rounded up: the last decimal must not take it below."""
    step = 10**-DECIMALS
    return f"{(int(value / step) + 1) * step:.{DECIMALS}f}"
