"""Cut a relief with a ball cutter: a rippled dome, from an STL surface, by OpenCAMLib's drop cutter.

Raster finishing along X, every second line backwards. OpenCAMLib drops the cutter on the surface along each line and
its line filter takes out the points that lie on a straight line within the tolerance.

Usage: python relief.py OUTPUT.nc    needs opencamlib and numpy
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator

import numpy as np
import opencamlib as ocl

SIZE = 80.0  # mm, square; the middle is X0 Y0
BALL = 4.0  # cutter diameter
STEP_OVER = 0.6
SAMPLING = 0.25  # distance of cutter positions along a line
TOLERANCE = 0.004
SAFE_Z = 5.0
FEED, PLUNGE, SPEED = 1800, 400, 12000


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The surface: rings that run out from the middle and six petals, on a dome; top at 0, bottom at -9 mm."""
    r = np.hypot(x, y) / (SIZE / 2)
    phi = np.arctan2(y, x)
    dome = np.clip(1 - r**2, 0, None)
    rings = 0.16 * np.cos(5 * np.pi * r) * np.exp(-1.2 * r)
    petals = 0.12 * np.cos(6 * phi) * np.sin(np.pi * np.clip(r, 0, 1)) ** 2
    return 9.0 * (np.clip(0.72 * dome + rings + petals, 0, 0.9) / 0.9 - 1)


def surface(step: float = 0.8) -> ocl.STLSurf:
    """The height field as triangles."""
    edge = np.arange(-SIZE / 2 - BALL, SIZE / 2 + BALL + step / 2, step)
    x, y = np.meshgrid(edge, edge)
    z = height(x, y)
    stl = ocl.STLSurf()
    point = [[ocl.Point(*map(float, p)) for p in zip(*row, strict=True)] for row in zip(x, y, z, strict=True)]
    for row, above in itertools.pairwise(point):
        for n in range(len(row) - 1):
            stl.addTriangle(ocl.Triangle(row[n], row[n + 1], above[n]))
            stl.addTriangle(ocl.Triangle(row[n + 1], above[n + 1], above[n]))
    return stl


def lines(stl: ocl.STLSurf) -> Iterator[list[ocl.CLPoint]]:
    """Cutter positions along one line after the other."""
    half = SIZE / 2
    along = np.linspace(-half, half, round(SIZE / SAMPLING) + 1)
    across = np.arange(-half, half + STEP_OVER / 2, STEP_OVER)
    drop = ocl.BatchDropCutter()
    drop.setSTL(stl)
    cutter = ocl.BallCutter(BALL, 30.0)  # setCutter keeps no reference
    drop.setCutter(cutter)
    for n, y in enumerate(across):
        for x in along if n % 2 == 0 else along[::-1]:
            drop.appendPoint(ocl.CLPoint(float(x), float(y), -9.0))
    drop.run()
    points = drop.getCLPoints()
    for n in range(len(across)):
        line_filter = ocl.LineCLFilter()
        line_filter.setTolerance(TOLERANCE)
        for point in points[n * len(along) : (n + 1) * len(along)]:
            line_filter.addCLPoint(point)
        line_filter.run()
        yield line_filter.getCLPoints()


def gcode(passes: Iterator[list[ocl.CLPoint]]) -> Iterator[str]:
    yield from (f"(relief: OpenCAMLib {ocl.version()}, ball cutter {BALL:g} mm, step-over {STEP_OVER:g} mm)",)
    yield from ("G21 G90 G17 G94", f"G0 Z{SAFE_Z:.3f}", f"M3 S{SPEED}", "G4 P2")
    is_first = True
    for points in passes:
        first, *others = points
        if is_first:
            yield from (f"G0 X{first.x:.3f} Y{first.y:.3f}", f"G1 Z{first.z:.3f} F{PLUNGE}", f"F{FEED}")
        else:
            yield f"G1 X{first.x:.3f} Y{first.y:.3f} Z{first.z:.3f}"
        is_first = False
        for point in others:
            yield f"X{point.x:.3f} Z{point.z:.3f}"
    yield from (f"G0 Z{SAFE_Z:.3f}", "M5", "G0 X0 Y0", "M30")


def main(path: str) -> None:
    with open(path, "w") as file:
        file.writelines(line + "\n" for line in gcode(lines(surface())))


if __name__ == "__main__":
    main(sys.argv[1])
