"""Draw the copper side of a small board as Gerber RS-274X, with its outline and an Excellon drill file.

It is an RC servo tester: a timer in DIP-8, a potentiometer, a servo header, a power terminal and five 0805 parts.

Usage: python pcb.py DIRECTORY    writes pcb.gbr, pcb-outline.gbr and pcb.drl
"""

from __future__ import annotations

import sys
from pathlib import Path

WIDTH, HEIGHT = 36.0, 26.0

DIP = [(10.0 + 2.54 * n, 9.0) for n in range(4)] + [(17.62 - 2.54 * n, 16.62) for n in range(4)]
SERVO = [(31.0, 8.0 + 2.54 * n) for n in range(3)]
POT = [(25.0, 18.0), (25.0, 20.5), (25.0, 23.0)]
POWER = [(4.0, 19.0), (4.0, 14.0)]
SMD = [
    (7.0, 4.0),
    (9.0, 4.0),
    (14.0, 4.0),
    (16.0, 4.0),
    (21.0, 6.0),
    (23.0, 6.0),
    (8.0, 22.0),
    (10.0, 22.0),
    (16.0, 22.0),
]
SMD += [(18.0, 22.0)]

TRACKS = [
    (0.8, [POWER[0], (4.0, 22.0), SMD[6]]),
    (0.8, [SMD[6], (8.0, 16.62), DIP[7]]),
    (0.8, [POWER[1], (4.0, 9.0), DIP[0]]),
    (0.8, [(4.0, 9.0), (4.0, 4.0), SMD[0]]),
    (0.4, [SMD[1], (11.27, 4.0), (12.54, 6.5), DIP[1]]),
    (0.4, [DIP[1], (12.54, 12.0), (15.08, 14.0), DIP[5]]),
    (0.4, [SMD[2], (14.0, 6.5), (15.08, 7.5), DIP[2]]),
    (0.4, [SMD[3], (18.5, 4.0), SMD[4]]),
    (0.4, [SMD[5], (28.0, 6.0), (31.0, 8.0)]),
    (0.4, [DIP[3], (21.0, 9.0), (23.5, 11.5), SERVO[2]]),
    (0.4, [DIP[6], (12.54, 20.0), SMD[7]]),
    (0.4, [DIP[4], (20.0, 18.0), POT[0]]),
    (0.4, [SMD[8], (16.0, 19.5), (18.5, 19.5), (20.5, 20.5), POT[1]]),
    (0.4, [SMD[9], (20.0, 23.0), POT[2]]),
    (0.8, [SERVO[1], (34.0, 10.54), (34.0, 24.9), (6.0, 24.9), (4.0, 22.0)]),
]

HEAD = ["G04 RC servo tester, copper*", "%FSLAX34Y34*%", "%MOMM*%", "%LPD*%"]


def at(point: tuple[float, float], code: str) -> str:
    return f"X{round(point[0] * 1e4)}Y{round(point[1] * 1e4)}{code}*"


def copper() -> list[str]:
    """Round and oval pads as flashes, tracks as strokes of a round aperture."""
    lines = [*HEAD, "%ADD10C,0.8*%", "%ADD11C,0.4*%", "%ADD12O,1.6X2.2*%", "%ADD13C,1.9*%", "%ADD14R,1.2X1.4*%"]
    for aperture, pads in (("D12", DIP), ("D13", [*SERVO, *POT, *POWER]), ("D14", SMD)):
        lines += [f"{aperture}*", *(at(pad, "D03") for pad in pads)]
    for width, points in TRACKS:
        lines += ["D10*" if width == 0.8 else "D11*", at(points[0], "D02"), *(at(point, "D01") for point in points[1:])]
    return [*lines, "M02*"]


def outline() -> list[str]:
    """The board's edge: a rectangle with rounded corners, drawn with arcs."""
    r, w, h = 2.0, WIDTH, HEIGHT
    corners = [(w - r, 0, w, r, 0, r), (w, h - r, w - r, h, -r, 0), (r, h, 0, h - r, 0, -r), (0, r, r, 0, r, 0)]
    lines = [*HEAD, "%ADD10C,0.1*%", "D10*", "G75*", at((r, 0), "D02")]
    for x0, y0, x1, y1, i, j in corners:
        lines += ["G01*", at((x0, y0), "D01"), "G03*"]
        lines.append(at((x1, y1), f"I{round(i * 1e4)}J{round(j * 1e4)}D01"))
    return [*lines, "M02*"]


def drills() -> list[str]:
    lines = ["M48", "METRIC,TZ", "T1C0.8", "T2C1.0", "%", "G90", "G05", "T1"]
    lines += [f"X{x:.3f}Y{y:.3f}" for x, y in DIP]
    lines += ["T2", *(f"X{x:.3f}Y{y:.3f}" for x, y in [*SERVO, *POT, *POWER])]
    return [*lines, "T0", "M30"]


def main(directory: Path) -> None:
    for name, lines in (("pcb.gbr", copper()), ("pcb-outline.gbr", outline()), ("pcb.drl", drills())):
        (directory / name).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
