"""The polygon that a program of absolute straight moves means."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

WORD = re.compile(r"([XYZ])(-?[0-9.]+)")


def vertices_of(program: str) -> NDArray[np.float64]:
    points = [np.zeros(3)]
    for line in program.splitlines():
        at = points[-1].copy()
        for letter, value in WORD.findall(line):
            at["XYZ".index(letter)] = float(value)
        if WORD.search(line):
            points.append(at)
    return np.array(points)
