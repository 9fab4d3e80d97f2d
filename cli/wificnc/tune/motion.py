"""The motion of one axis from its step edges: position at any time, shaped or not. Needs numpy.

Between two edges the position is a straight line. An axis without an edge for REST_S rests; the next edge then takes
as long as the one after it.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wificnc.errors import JobError
from wificnc.tables import AXES
from wificnc.tune.shapers import Impulses

Floats = NDArray[np.float64]

REST_S = 0.05
CSV_HEADER = "t_ns,step_mask,dir_mask"


@dataclass(frozen=True)
class AxisMotion:
    """Corners of the position, and when the axis rests: [rest_from_s, rest_to_s], from the first motion on."""

    t_s: Floats
    mm: Floats
    rest_from_s: Floats
    rest_to_s: Floats

    def at(self, t_s: Floats, shape: Impulses) -> Floats:
        """The shaped position, mm."""
        total = np.zeros(len(t_s))
        for weight, delay in zip(shape.weights, shape.times_s, strict=True):
            total += weight * np.interp(t_s - delay, self.t_s, self.mm)
        return total

    def rests(self, t_s: Floats, shape: Impulses) -> NDArray[np.bool_]:
        """Whether the shaped axis rests: all copies are in the same rest."""
        index = np.searchsorted(self.rest_from_s, t_s - shape.duration_s, side="right") - 1
        found = index >= 0
        found[found] = t_s[found] <= self.rest_to_s[index[found]]
        return found


@dataclass(frozen=True)
class Trace:
    """All step edges of a job."""

    t_ns: NDArray[np.uint64]
    step_mask: NDArray[np.uint8]
    dir_mask: NDArray[np.uint8]

    def axis(self, index: int, steps_per_mm: float) -> AxisMotion | None:
        """The motion of an axis; None when it makes no step."""
        chosen = np.flatnonzero(self.step_mask >> index & 1)
        if not chosen.size:
            return None
        # Times from the begin of the trace: ns in the 53 bits of a double, and no loss by subtraction later.
        t_s = (self.t_ns[chosen] - self.t_ns[0]).astype(np.float64) * 1e-9
        steps = np.where(self.dir_mask[chosen] >> index & 1, -1.0, 1.0)
        return _motion(t_s, steps / steps_per_mm, (self.t_ns[-1] - self.t_ns[0]) * 1e-9)


def _motion(t_s: Floats, step_mm: Floats, end_s: float) -> AxisMotion:
    """From the time and the way of each step."""
    after = np.cumsum(step_mm)
    gaps = np.diff(t_s, prepend=-np.inf)
    rested = np.flatnonzero(gaps > REST_S)  # a rest ends at this step; the first one is among them
    next_gap = np.append(gaps[1:], REST_S)[rested]
    begins = t_s[rested] - np.minimum(next_gap, REST_S)
    before = after[rested] - step_mm[rested]
    corners_t = np.insert(t_s, rested, begins)
    corners_mm = np.insert(after, rested, before)
    order = np.argsort(corners_t, kind="stable")
    rest_from = np.append(t_s[rested[1:] - 1], t_s[-1])
    rest_to = np.append(begins[1:], max(end_s, t_s[-1]) + 1.0)
    return AxisMotion(corners_t[order], corners_mm[order], rest_from, rest_to)


def read_trace(path: Path) -> Trace:
    """A trace that `wificnc sim --trace` wrote: .npz or .csv. Raises JobError."""
    try:
        columns = _read_npz(path) if path.suffix.lower() == ".npz" else _read_csv(path)
    except OSError as err:
        raise JobError(f"cannot read {path}: {err.strerror}") from err
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as err:
        raise JobError(
            f"{path} is not a trace of step edges", hint="`wificnc sim JOB --trace T.npz` writes one; .csv works, too"
        ) from err
    if not len(columns[0]):
        raise JobError(f"{path} has no step edges")
    if np.any(columns[0][1:] < columns[0][:-1]):
        raise JobError(f"{path}: its times do not increase")
    return Trace(*columns)


def _read_npz(path: Path) -> tuple[Any, Any, Any]:
    with np.load(path) as arrays:
        t_ns, step_mask, dir_mask = (arrays[name] for name in ("t_ns", "step_mask", "dir_mask"))
    return t_ns.astype(np.uint64), step_mask.astype(np.uint8), dir_mask.astype(np.uint8)


def _read_csv(path: Path) -> tuple[Any, Any, Any]:
    with path.open(encoding="utf-8") as file:
        if not file.readline().startswith(CSV_HEADER):
            raise ValueError("header")
        table = np.loadtxt(file, delimiter=",", usecols=(0, 1, 2), dtype=np.uint64, ndmin=2)
    return table[:, 0], table[:, 1].astype(np.uint8), table[:, 2].astype(np.uint8)


def moving_axes(trace: Trace) -> tuple[int, ...]:
    """Indexes of the axes that make steps."""
    return tuple(index for index in range(len(AXES)) if np.any(trace.step_mask >> index & 1))
