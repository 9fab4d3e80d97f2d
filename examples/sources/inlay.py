"""Draw the cutter paths of a flower-of-life inlay as a DXF: 42 petals, each pocketed with arcs, and a ring around them.

A petal is where two circles of radius R around neighbouring triangles of the lattice overlap. Its outline moved inwards
by d is again two arcs, of radius R - d, around the same centres: so every pass of the pocket is exact arcs.

Usage: python inlay.py FILE.dxf    needs ezdxf
"""

from __future__ import annotations

import itertools
import math
import sys

import ezdxf

R = 20.0  # lattice and arc radius, mm
TOOL = 2.0  # diameter

STEP_OVER = 0.8
RING = (46.0, 47.5)  # inner and outer edge paths of the ring
LAYER = "inlay"

Point = tuple[float, float]


def lattice() -> list[Point]:
    """The 19 points of the triangular lattice within two steps of the middle."""
    points = []
    for q, r in itertools.product(range(-2, 3), repeat=2):
        if abs(q + r) <= 2:
            points.append((R * (q + r / 2), R * r * math.sqrt(3) / 2))
    return points


def petal(a: Point, b: Point, inset: float) -> list[tuple[float, float, float]] | None:
    """The petal from a to b moved inwards, as (x, y, bulge); None when nothing is left."""
    half_gap = R * math.sqrt(3) / 2  # from the petal's axis to each arc's centre
    radius = R - inset
    if radius <= half_gap + 1e-9:
        return None
    half_length = math.sqrt(radius**2 - half_gap**2)
    ux, uy = (b[0] - a[0]) / R, (b[1] - a[1]) / R
    mx, my = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    bulge = math.tan(math.asin(half_length / radius) / 2)
    tips = [(mx - ux * half_length, my - uy * half_length), (mx + ux * half_length, my + uy * half_length)]
    return [(x, y, bulge) for x, y in tips]


def main(path: str) -> None:
    document = ezdxf.new("R2000", setup=False)
    document.layers.add(LAYER)
    space = document.modelspace()
    points = lattice()
    for a, b in itertools.combinations(points, 2):
        if abs(math.dist(a, b) - R) > 1e-6:
            continue
        for n in itertools.count():
            outline = petal(a, b, TOOL / 2 + n * STEP_OVER)
            if outline is None:
                break
            space.add_lwpolyline(outline, format="xyb", close=True, dxfattribs={"layer": LAYER})
    for radius in RING:
        space.add_circle((0, 0), radius, dxfattribs={"layer": LAYER})
    document.saveas(path)


if __name__ == "__main__":
    main(sys.argv[1])
