"""A lathe in virtual time: a controller whose spindle has an encoder, and what its tool really does to the work."""

from __future__ import annotations

import numpy as np
from grbl_host import Grbl
from numpy.typing import NDArray

STEPS_MM = 1000
ACCEL_MM_S2 = 500.0
INDEX_REV = 0.375  # of the virtual spindle; targets/pc/virtual_spindle.c
STEP_MM = 1 / STEPS_MM
DT_S = 0.0005


class Lathe(Grbl):
    """X and Z of 1 um a step, 5000 mm/min, 500 mm/s2; the spindle gains 2000 rpm a second."""

    def __init__(self, counts: int = 4096, encoder: bool = True) -> None:
        super().__init__(encoder=encoder)
        self.send("")
        axes = range(3)
        self.settings(**{f"s{100 + ax}": STEPS_MM for ax in axes})
        self.settings(**{f"s{110 + ax}": 5000 for ax in axes}, **{f"s{120 + ax}": ACCEL_MM_S2 for ax in axes})
        self.settings(s30=3000, s88=counts)
        self.spindle_ramp(2000)

    def watch(self, line: str, seconds: float = 60.0) -> tuple[str, Course]:
        """Send a line and look at tool and spindle each DT_S until it is answered and all is at rest."""
        said, rows = self.after(0, line + "\n"), []
        for _ in range(round(seconds / DT_S)):
            said += self.after(DT_S)
            x, _, z, *_ = self.stands()
            rows.append((self.time(), self.spindle_angle(), x * STEP_MM, z * STEP_MM, self.spindle_rpm()))
            if said and (len(rows) < 2 or rows[-1][2:4] == rows[-2][2:4]):
                break
        return said, Course(np.array(rows))

    def pass_of(self, line: str) -> Course:
        said, course = self.watch(line)
        assert said == "ok\r\n", said
        return course

    def limits_kept(self) -> bool:
        """Since record(): no axis beyond its acceleration, in windows of 10 ms; a step is 1 um."""
        quantum = 4 * STEP_MM / 0.01**2
        return bool(np.abs(self.accelerations(0.01) / STEPS_MM).max() <= ACCEL_MM_S2 * 1.01 + quantum)


class Course:
    """Samples of a motion: time, revolutions of the spindle, X and Z in mm, rpm."""

    def __init__(self, rows: NDArray[np.float64]) -> None:
        self.t, self.rev, self.x, self.z, self.rpm = rows.T

    def part(self, which: NDArray[np.bool_]) -> Course:
        return Course(np.stack([self.t, self.rev, self.x, self.z, self.rpm])[:, which].T)

    def along_z(self, least: float, most: float) -> Course:
        """Where |z| lies between these."""
        return self.part((np.abs(self.z) >= least) & (np.abs(self.z) <= most))

    def off_mm(self, pitch_mm: float, sense: int = 1, start_mm: float = 0.0) -> NDArray[np.float64]:
        """Tool next to the thread's line through `start_mm`, mm of pitch; the line meets the start at the index."""
        line = sense * (self.rev - INDEX_REV) * pitch_mm
        off = np.abs(self.z - start_mm) - line
        return np.asarray((off + pitch_mm / 2) % pitch_mm - pitch_mm / 2)
