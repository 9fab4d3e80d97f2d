"""The job that every sender streams, and where it ends."""

from __future__ import annotations

import math
from pathlib import Path

LINES = 300
KEY = "k7qf3-x2m9d-0abcd-efghj"  # of the controllers that are locked


def write_job(path: Path) -> list[float]:
    """A ring of short segments, an arc, comments, and a known end. @return the end, mm"""
    lines = ["(a job for real senders)", "G21 G90 G94", "G0 X0 Y0 Z2", "M3 S1000", "G1 Z-0.5 F600"]
    for n in range(LINES):
        angle = 2 * math.pi * n / LINES
        lines.append(f"G1 X{10 * math.sin(angle):.3f} Y{10 - 10 * math.cos(angle):.3f} F3000")
    lines += ["G1 X0 Y0", "G2 X5 Y5 I2.5 J2.5", "G0 Z2 ; away", "M5", "G0 X12.5 Y-3.2", "G1 Z-1.5 F600", "M30", ""]
    path.write_text("\n".join(lines))
    return [12.5, -3.2, -1.5]
