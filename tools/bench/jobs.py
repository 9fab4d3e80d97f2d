"""Programs that are hard to move along, made by formulas: a finely chopped curve, reversals, a surface, noise."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from pathlib import Path

HEAD = "G21 G90 G17 G94"


def chopped_circle() -> Iterator[str]:
    """A circle of 25.4 mm in chords of 0.016 mm, four decimals."""
    yield "G0 Y25.4"
    yield "G1 F9999"
    for n in range(1, 10_001):
        angle = math.tau * n / 10_000
        yield f"X{25.4 * math.sin(angle):.4f} Y{25.4 * math.cos(angle):.4f}"


def zigzag() -> Iterator[str]:
    """Hatching: long lines with a short step between them, then teeth of half a millimetre."""
    yield "G1 F4000"
    for n in range(20):
        yield f"X{40 if n % 2 == 0 else 0} Y{n * 0.3:.1f}"
        yield f"Y{(n + 1) * 0.3:.1f}"
    for n in range(400):
        yield f"X{n * 0.1:.1f} Y{6.5 if n % 2 else 6.0}"


def relief() -> Iterator[str]:
    """Rows over a wavy surface in chords of 0.2 mm: every axis bends, nothing can be left out."""
    yield "G1 F4000"
    for row in range(12):
        for n in range(201):
            x, y = 0.2 * (n if row % 2 == 0 else 200 - n), 0.5 * row
            z = 1.5 * math.sin(0.9 * x) * math.cos(0.7 * y) + 0.4 * math.sin(2.3 * x + y)
            yield f"X{x:.3f} Y{y:.3f} Z{z:.3f}"


def corners() -> Iterator[str]:
    """A random walk in space, chords of 0.02 to 8 mm, feeds and rapids mixed."""
    rng = random.Random(4)
    at = [0.0] * 3
    for _ in range(1500):
        size = 10 ** rng.uniform(-1.7, 0.9)
        at = [min(40.0, max(-40.0, value + rng.uniform(-size, size))) for value in at]
        code = rng.choice(["G0", "G1 F600", "G1 F2500", "G1 F9000"])
        yield f"{code} X{at[0]:.3f} Y{at[1]:.3f} Z{at[2]:.3f}"


JOBS: tuple[Callable[[], Iterator[str]], ...] = (chopped_circle, zigzag, relief, corners)


def write_jobs(folder: Path) -> list[Path]:
    """All of them as files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for job in JOBS:
        path = folder / f"{job.__name__}.nc"
        path.write_text("\n".join([HEAD, *job(), "M2"]) + "\n")
        paths.append(path)
    return paths
