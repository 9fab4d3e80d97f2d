"""Path samples as arrays, made light enough to draw. Needs numpy (extra `plot`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wificnc.simulator.library import SAMPLE_DTYPE
from wificnc.simulator.look import SPEED_LEVELS

Floats = NDArray[np.float64]
COLUMNS = 2400  # of the speed panel, more than it has pixels
MAX_PASSES = 16


@dataclass(frozen=True)
class Path:
    """Points and how each was reached; the segment before a point has its speed and kind."""

    t_s: Floats
    xyz_mm: Floats  # (n, 3)
    speed_mm_min: Floats
    rapid: NDArray[np.bool_]

    def take(self, chosen: NDArray[Any]) -> Path:
        return Path(self.t_s[chosen], self.xyz_mm[chosen], self.speed_mm_min[chosen], self.rapid[chosen])

    @property
    def top_speed_mm_min(self) -> float:
        """Of the cuts; of the rapids when there are no cuts; 1 when nothing moves."""
        cuts = self.speed_mm_min[~self.rapid]
        speeds = cuts if cuts.size else self.speed_mm_min
        return max(float(speeds.max()), 1.0) if speeds.size else 1.0


def path_from_samples(samples: bytes) -> Path:
    """library.Simulation.samples() as arrays."""
    records = np.frombuffer(samples, dtype=SAMPLE_DTYPE)
    return Path(
        records["t_s"].astype(np.float64),
        records["position_mm"][:, :3].astype(np.float64),
        records["speed_mm_s"].astype(np.float64) * 60.0,
        records["rapid"] != 0,
    )


def simplify(path: Path, tolerance_mm: float) -> Path:
    """Drop points that lie on the chord of their neighbours, where kind and colour stay the same.

    Works on every second point at a time, so that a pass is one sweep of numpy over the whole path.
    """
    levels = np.minimum((path.speed_mm_min / path.top_speed_mm_min * SPEED_LEVELS).astype(int), SPEED_LEVELS)
    kind = np.where(path.rapid, -1, levels)
    kept = np.arange(len(kind))
    for round_ in range(MAX_PASSES):
        middle = np.arange(1 + round_ % 2, len(kept) - 1, 2)
        if middle.size == 0:
            break
        here, after = kept[middle], kept[middle + 1]
        offset_mm = _chord_distance(path.xyz_mm[kept[middle - 1]], path.xyz_mm[here], path.xyz_mm[after])
        dropped = middle[(offset_mm < tolerance_mm) & (kind[here] == kind[after])]
        kept = np.delete(kept, dropped)
    return path.take(kept)


def _chord_distance(begin: Floats, point: Floats, end: Floats) -> Floats:
    """Distance of points from the segments begin-end."""
    chord = end - begin
    length_sq = np.einsum("ij,ij->i", chord, chord)
    along = np.einsum("ij,ij->i", point - begin, chord) / np.where(length_sq > 0.0, length_sq, 1.0)
    foot = begin + np.clip(along, 0.0, 1.0)[:, None] * chord
    distance: Floats = np.linalg.norm(point - foot, axis=1)
    return distance


def envelope(path: Path) -> Path:
    """For the speed panel: of each column of time the first, lowest, highest and last point."""
    count = len(path.t_s)
    if count <= 4 * COLUMNS:
        return path
    column = np.minimum((path.t_s - path.t_s[0]) / np.ptp(path.t_s) * COLUMNS, COLUMNS - 1).astype(int)
    by_speed = np.lexsort((path.speed_mm_min, column))
    begins = np.flatnonzero(np.diff(column, prepend=-1))
    ends = np.append(begins[1:], count) - 1
    return path.take(np.unique(np.concatenate([begins, ends, by_speed[begins], by_speed[ends]])))


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches of points whose segments are in the mask: (first point, last point + 1); the point before counts."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return [(max(int(a) - 1, 0), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def isometric(xyz_mm: Floats) -> Floats:
    """Seen from the front right, above: X to the lower right, Y to the upper right, Z up, all in true length."""
    x, y, z = xyz_mm[..., 0], xyz_mm[..., 1], xyz_mm[..., 2]
    return np.stack([(x + y) * np.sqrt(0.75), (y - x) * 0.5 + z], axis=-1)


def nearness(xyz_mm: Floats) -> Floats:
    """Grows towards the eye of isometric()."""
    near: Floats = xyz_mm[..., 0] - xyz_mm[..., 1] + xyz_mm[..., 2]
    return near
