"""Accelerations from step edges alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

AXES = 6


def accelerations(
    t: NDArray[np.float64], step: NDArray[np.uint8], direction: NDArray[np.uint8], window_s: float
) -> NDArray[np.float64]:
    """Steps/s^2 per axis by box differences of the positions. @param t  of each event, s. step, direction  its masks"""
    bits = np.arange(AXES)
    sense = 1 - 2 * (direction[:, None] >> bits & 1).astype(np.int64)
    path = np.cumsum((step[:, None] >> bits & 1) * sense, axis=0)
    grid = np.arange(t[0] - 3 * window_s, t[-1] + 3 * window_s, window_s / 10)
    at = np.stack([np.interp(grid, t, path[:, axis]) for axis in range(AXES)], axis=1)
    return (at[20:] - 2 * at[10:-10] + at[:-20]) / window_s**2
