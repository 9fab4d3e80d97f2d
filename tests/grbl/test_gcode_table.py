"""Checklist 4.3: the table of G-code checks, over the stream and through the whole machine."""

from __future__ import annotations

import pytest
from grbl_host import Grbl

# lines | answer to the last one
TABLE = """
G1X1 | 22
F100,G2X1Y0R0.1 | 34
G2X1Y1F1e4 | 20
F100,G2X1Y1 | 35
F100,G2X10Y0I4 | 33
G80X1 | 31
F100,G53G2X1Y1I1 | 30
F100,G53G38.2Z-1 | 30
F100,G38.2Z0 | 33
G43.1X1 | 37
G1.5 | 23
G54.1 | 23
G21.5 | 23
M56 | 20
G0A1 | 20
G0B1 | 20
G0H1 | 20
F0,G1 | 22
G0X1X2 | 25
G0G1X1 | 24
G17G18 | 21
G55G54 | 21
G10L2P1 | 26
G92 | 26
G10P1X0 | 20
G10L2X0 | 0
G4 | 28
G4P-1 | 4
G4P0 | 0
P1 | 36
L2 | 36
I1 | 36
K1 | 36
R1 | 36
S-1 | 4
F-1 | 4
T256 | 38
T1.5 | 0
F100,G93G1X1 | 22
G0 | 0
G1 | 22
"""
# Grbl refuses these (error:20, 23 or 29) because it does not know the codes; we do, and answer what is missing.
BEYOND = """
G59.3 | 0
G59.4 | 20
G10L2P7 | 26
G10L2P10 | 29
G81 | 22
F100,G81 | 26
F100,G81X1 | 28
M48 | 0
M62 | 28
M52 | 20
"""
NEEDS = {"G0A1": "no axis A", "G0B1": "no axis B"}  # of a board (needs.py)
ROWS = [
    pytest.param(lines.split(","), int(answer), marks=[pytest.mark.needs(NEEDS[lines])] if lines in NEEDS else [])
    for lines, answer in (row.split(" | ") for row in (TABLE + BEYOND).splitlines() if row)
]


@pytest.mark.parametrize(
    ("lines", "answer"), ROWS, ids=lambda value: "+".join(value) if isinstance(value, list) else ""
)
def test_row(grbl: Grbl, lines: list[str], answer: int) -> None:
    """Each row of the table: nothing moves, and the answer is Grbl's, or one in its words."""
    said = grbl.send("\n".join(lines) + "\n")
    assert said.split("\r\n")[len(lines) - 1] == (f"error:{answer}" if answer else "ok")
    assert grbl.position() == [0] * 6
