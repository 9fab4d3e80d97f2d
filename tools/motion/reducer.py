"""core/motion/reduce.c, called one point at a time, to see what it allows."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

from wificnc.build.host import ensure_host_library

AXES, LANES, KEPT = 6, 8, 2


class Reduce(ctypes.Structure):
    """struct reduce of core/motion/reduce.h"""

    _fields_ = (
        ("anchor_mm", ctypes.c_double * AXES),
        ("chord", ctypes.c_float * LANES),
        ("middle", ctypes.c_float * LANES),
        ("radius", ctypes.c_float),
        ("reach_mm", ctypes.c_float),
        ("open", ctypes.c_bool),
        ("aimed", ctypes.c_bool),
        ("kept", ctypes.c_float * LANES * KEPT),
        ("dropped", ctypes.c_uint32),
    )


class Reducer:
    """One chord: from the anchor on."""

    def __init__(self, anchor_mm: Sequence[float]) -> None:
        self._library = ctypes.CDLL(str(ensure_host_library()))
        self._library.reduce_accepts.argtypes = (ctypes.c_void_p, ctypes.c_double * AXES, *[ctypes.c_float] * 2)
        self._library.reduce_accepts.restype = ctypes.c_bool
        self._state = Reduce()
        self._library.reduce_reset(ctypes.byref(self._state), _point(anchor_mm))

    def accepts(self, point_mm: Sequence[float], tolerance_mm: float) -> bool:
        """Whether the chord may end there."""
        return bool(self._library.reduce_accepts(ctypes.byref(self._state), _point(point_mm), tolerance_mm, math.inf))

    @property
    def middle(self) -> tuple[float, float]:
        """Of the directions allowed: X, Y."""
        return self._state.middle[0], self._state.middle[1]

    @property
    def radius(self) -> float:
        """Of the ball of directions."""
        return float(self._state.radius)


def _point(mm: Sequence[float]) -> ctypes.Array[ctypes.c_double]:
    return (ctypes.c_double * AXES)(*mm, *[0.0] * (AXES - len(mm)))
