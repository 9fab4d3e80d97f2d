"""The C kinematics by ctypes, and the same machines in numpy: written again from the geometry, to compare with."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import byref

import numpy as np
from c_library import LIB
from layouts import HOST
from numpy.typing import NDArray

AXES = 6
CARTESIAN, COREXY, POLAR, SCARA = range(4)
Vector = ctypes.c_double * AXES


class Machine:
    """One kind of machine."""

    def __init__(self, kind: int, arm_mm: Sequence[float] = (50, 50), travel_mm: Sequence[float] = (150, 0)) -> None:
        self.kind, self.arm_mm, self.travel_mm = kind, arm_mm, travel_mm
        self._c = HOST.struct("kinematics")()
        LIB.kinematics_init(byref(self._c), kind, (ctypes.c_float * 2)(*arm_mm), (ctypes.c_float * 2)(*travel_mm))
        self._ops = self._c.ops.contents

    def forward(self, joints: Sequence[float]) -> list[float]:
        out = Vector()
        self._ops.forward(byref(self._c), Vector(*joints), out)
        return list(out)

    def inverse(self, tool_mm: Sequence[float], near: Sequence[float] = (0,) * AXES) -> list[float]:
        out = Vector()
        self._ops.inverse(byref(self._c), Vector(*tool_mm), Vector(*near), out)
        return list(out)

    def bend_mm(self, start: Sequence[float], end: Sequence[float]) -> float:
        return float(self._ops.bend_mm(byref(self._c), Vector(*start), Vector(*end)))

    def stretch(self, start: Sequence[float], end: Sequence[float]) -> float:
        return float(self._ops.stretch(byref(self._c), Vector(*start), Vector(*end)))

    def reaches(self, start: Sequence[float], end: Sequence[float]) -> bool:
        return bool(LIB.kinematics_reaches(byref(self._c), Vector(*start), Vector(*end)))

    @property
    def is_coupled(self) -> bool:
        return bool(self._c.coupled)

    @property
    def bends_lines(self) -> bool:
        return bool(self._ops.bend_mm)

    def tool_mm(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """X and Y of the tool for rows of joints: the oracle."""
        a, b = joints[..., 0], joints[..., 1]
        if self.kind == COREXY:
            return np.stack([(a + b) / 2, (a - b) / 2], axis=-1)
        if self.kind == POLAR:
            return np.stack([a * np.cos(np.radians(b)), a * np.sin(np.radians(b))], axis=-1)
        if self.kind == SCARA:
            arms, angles = np.array(self.arm_mm), np.radians(joints[..., :2])
            return np.stack([(arms * np.cos(angles)).sum(axis=-1), (arms * np.sin(angles)).sum(axis=-1)], axis=-1)
        return joints[..., :2]
