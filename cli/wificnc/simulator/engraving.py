"""What a laser burnt, as arrays and as a picture of grey pixels. Needs numpy (extra `plot`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wificnc.simulator import look
from wificnc.simulator.library import PIECE_DTYPE

Floats = NDArray[np.float64]
MS_PER_S = 1000.0
PARTS_PER_PIXEL = 2
PARTS_AT_ONCE = 1 << 20  # so many parts of pieces in memory


@dataclass(frozen=True)
class Pieces:
    """Straight pieces with the beam on. energy_by_mm: ms at full power, or J when the power is known."""

    from_mm: Floats  # (n, 3)
    to_mm: Floats
    length_mm: Floats
    energy_by_mm: Floats

    @property
    def typical(self) -> float:
        """As much as all but a few mm of the path get: what is slow at corners does not count."""
        order = np.argsort(self.energy_by_mm)
        lengths = np.cumsum(self.length_mm[order])
        at = np.searchsorted(lengths, look.ENGRAVING_QUANTILE * lengths[-1])
        return float(self.energy_by_mm[order[min(int(at), len(order) - 1)]])

    @property
    def black(self) -> float:
        """From here on the picture is black."""
        return look.ENGRAVING_BLACK * self.typical


def pieces_from(records: bytes, laser_w: float | None) -> tuple[Pieces, Floats]:
    """The pieces, and where the beam burnt at rest.

    laser_w: optical power; without it the energy is that of a time at full power.
    """
    found = np.frombuffer(records, dtype=PIECE_DTYPE)
    at_rest = found["length_mm"] <= 0
    moved = found[~at_rest]
    length_mm = moved["length_mm"].astype(np.float64)
    energy = moved["energy_s"].astype(np.float64) * (MS_PER_S if laser_w is None else laser_w)
    begins, ends = (moved[name].astype(np.float64) for name in ("from_mm", "to_mm"))
    return Pieces(begins, ends, length_mm, energy / length_mm), found["from_mm"][at_rest].astype(np.float64)


def unit(laser_w: float | None) -> str:
    """Of energy_by_mm."""
    return "ms of full power per mm" if laser_w is None else "J/mm"


def rasterise(pieces: Pieces, begins: Floats, ends: Floats, low: Floats, high: Floats, width: int) -> Floats:
    """Energy by mm of each pixel between two corners, NaN where nothing burnt: its energy by the length of path in it.

    begins, ends: of the pieces in the plane of the picture. The first row is the lowest.
    """
    pixel = (high[0] - low[0]) / width
    height = max(1, round((high[1] - low[1]) / pixel))
    energy, length_mm = np.zeros(width * height), np.zeros(width * height)
    for piece, at, part in _parts(np.linalg.norm(ends - begins, axis=1) / pixel):
        places = begins[piece] + at[:, None] * (ends - begins)[piece]
        column, row = np.floor((places - low) / pixel).astype(int).T
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        cell, piece = (row * width + column)[inside], piece[inside]
        part_mm = pieces.length_mm[piece] * part[inside]
        length_mm += np.bincount(cell, part_mm, width * height)
        energy += np.bincount(cell, part_mm * pieces.energy_by_mm[piece], width * height)
    with np.errstate(invalid="ignore"):
        return (energy / length_mm).reshape(height, width)


def _parts(size_px: Floats) -> Iterator[tuple[NDArray[Any], Floats, Floats]]:
    """Pieces cut into parts shorter than a pixel: number of the piece, place along it (0 .. 1), share of it."""
    counts = np.maximum(1, np.ceil(PARTS_PER_PIXEL * size_px)).astype(int)
    ends = np.cumsum(counts)
    first = 0
    while first < len(counts):
        done = ends[first] - counts[first]
        last = max(first + 1, int(np.searchsorted(ends, done + PARTS_AT_ONCE, side="right")))
        piece = np.repeat(np.arange(first, last), counts[first:last])
        nth = np.arange(len(piece)) - (ends[piece] - counts[piece] - done)
        yield piece, (nth + 0.5) / counts[piece], 1.0 / counts[piece]
        first = last
