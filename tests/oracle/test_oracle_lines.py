"""Short programs that show one rule each: LinuxCNC moves as we do."""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CDLL
from pathlib import Path

import pytest
from canon import Refused, rs274
from compare import check_same
from gcode_core import XYZABC
from ours import Ours

PROGRAMS = {
    "units": "G21F100|G0X1Y2Z3A10B20C30|G1X5A15|G20|G1X1A20|F10|G1X2|G21|G1X5",
    "modal motion": "G1X1F5|Y1|G0|X2|G1|X3|G80|G0X1|Y2",
    "home without axis words": "G1X5Y5Z5F100|G28.1|G0X0Y0Z0|G28|G0X1Y1|G30",
    "home through a point": "G1X5Y5Z5F100|G28.1|G0X0Y0Z0|G91|G28Z5|G90|G30.1|G30X1Y2|G28Y1",
    "home through a point, in offsets": "G10L2P1X1Y2Z3|G92X4|G43.1Z2|G28X5Z1|G30Y1",
    "offsets add up": "F100|G10L2P1X1Y2Z3|G1X5Y5Z5|G92X0Y1|G1X3Y3|G43.1Z2|G0Z0|G49|G53G0X1Z1|G0X3|G92.1|G0X0Y0Z0",
    "G10 L20 in offsets": "G10L2P1X1Y2Z3|G0X5Y5Z5|G92X2|G10L20P0X7|G0X0|G43.1Z2|G0Z0|G10L20P1Z0|G0Z1|G10L20P2Y9|G55Y0",
    "coordinate systems": "G55|G10L2P2X10|G0X0|G54|G0X0|G59|G92X1|G10L2P6X3|G0X0Y0|G57G1Y3F7|G56X1|G58X2",
    "offsets in inches": "F100|G92X5|G43.1Z1|G20|F5|G1X1Z1|G92Y1|G1Y2|G10L20P1X1|G0X0|G21X0|G43.1Z3|Z0",
    "offsets in incremental mode": "G91|G10L2P1X5|G0X1|G92X2|G0X1|G10L20P0Y3|G90X0Y0",
    "inverse time": "G93|G1X10Y20F2|X5F3|G2X0I-2.5F1|G18G3X4Z4R4Y9F1|G94|F100|G1X3",
    "arc offsets": "F100|G17|G2X10I5|G3X0I-5Z4|G2X3Y3I1.5J1.5|G2X3I5J3Z0",
    "arc offsets in the other planes": "F100|G18|G2Z10K5|G3X5Z5K-5|G19|G2Y3Z8J3|G3Y3Z8J1K2X4",
    "arc radii": "F100|G2X10R6|G3X0R-7|G18|G2X5Z5R5|G19|G3Y3Z3R-4X2",
    "circles without axis words": "F100|G2I-10|G3J4|G18G2K3|G19G3J-2|G17G91G2I3|G90.1G90G2I5J5",
    "helices without axes of the plane": "F100|G2Z-1I-10|Z-2I-10|G18G3Y4K2|G19G2X1J1A5",
    "turns": "F100|G0X10|G3X10Y0Z-3I-10P3|G2X0Y10I-10P2|G3I2P4|G18G2X5Z5R6P2",
    "after G80": "F100|G81Z-1R1|G80|G92X0|G10L20P1Y0|G30Z5|G28|G43.1Z1|G0X1",
    "G80 next to a motion": "F100|G81X1Z-1R1|G0G80X2|G81X3Z-1R1|G80G1X4|G80G2X5I.5|G0G17G40G49G80G90|X6",
    "G49 next to a motion": "G43.1Z2|G0Z5|G0G49Z5|G43.1Z1|G1G49F5|G1Z3",
    "G64 with Q": "F100|G64P.1Q.05|G1X1|G64Q.1|G1Y1",
    "arcs with absolute centres": "F100|G90.1|G2X10I5J0|G92X3|G3X-7I-2J0|G91|G2X10I-2J0|G91.1|G2X5Y5I5",
    "full circles": "F100|G91|G2X0I5|G3X0Y0I3J4Z2|G18|G2Z0K-3|G19|G3Y0J1K1X1",
    "full circles in inches": "G20|F10|G91|G2X0I1|G18G3Z0K.5Y1",
    "arcs in inches": "G20|F10|G2X1I.5|G3X2Y1R1|G18G2X3Z1I.5K.5",
    "drilling": "F100|G0X1Y2Z3|G98G81X4Y5Z1.5R2.8|X7|Y2|G99X1|X2R2|G80|G0X0",
    "drilling from below R": "F100|G0X1Y1Z1|G98G81X2Z0R3|X3Z-1|X4R.5",
    "drilling in incremental mode": "F100|G0X1Y2Z3|G91G98G81X4Y5Z-.6R1.8L3|X1",
    "rows in incremental mode": "F100|G0Z5|G91G99G81X1Z-1R-1|X1|X1Z-2|X1R-2L2|G80|G0Z1",
    "drilling in the other planes": "F100|G98|G0X5Y5Z5|G18G81X1Y-2R1Z3|Z5|G17G80|G19G82Y1Z1X-1R2P0|Z2",
    "pecks": "F100|G0Z5|G99G83X1Z-1R2Q1|X2|Z-1.2Q.7|G80|G98G73X3Z-1.2R2Q.7|G99X4",
    "boring": "F100M3S9|G98|G0Z5|G82X1Z1R2P.5|X2P.25|G85X3Z0R2|G99G86X3Z0R2P1|G89X4Y4P.1Z0R1|G80|G0X1",
    "drilling in inches and offsets": "G43.1Z3F100|G92X1|G20|F9|G0Z1|G99G81X1Z.1R.5|G83X2Q.1Z-.25R.4|G55X3",
    "dwells": "G4P1.5|G1X1F6|G4P0|G0X3",
    "words around moves": "G61|G1X1F5|G64P0.1|X2|M3S100|G1X3M8|M0|M5M9|T3|N10G0X5(a remark)",
    "probe": "F100|G38.2X3Z-5",
}


@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS.keys())
def test_rule(agree: Callable[[str], int], program: str) -> None:
    assert agree(program.replace("|", "\n") + "\nM2\n") > 0


PAIRS = [
    ("G2X10I5F9", "G3X10I5F9"),
    ("G2X10I5F9", "G18G2X10I5F9"),
    ("G3X10R6F9", "G3X10R6.001F9"),
    ("G3X10R6F9", "G3X10R-6F9"),
    ("G1X1F9", "G1X1F9.001"),
    ("G1X1F9", "G0X1"),
    ("G1X1.001F9", "G1X1F9"),
    ("G0X1A1", "G0X1A1.001"),
    ("G4P1", "G4P1.001"),
    ("G0X1", "G0X1\nG0X2"),
    ("G0X1\nG0X2", "G0X1"),
    ("G92X1\nG0X2", "G92X1.001\nG0X2"),
    ("G43.1Z1\nG0Z2", "G0Z2"),
]


@pytest.mark.parametrize(("ours", "theirs"), PAIRS)
def test_a_difference_is_seen(lib: CDLL, tmp_path: Path, ours: str, theirs: str) -> None:
    """A comparison that cannot fail proves nothing."""
    here = Ours(lib, XYZABC)
    for line in ours.splitlines():
        here.run(line)
    there = rs274(theirs + "\nM2\n", tmp_path)
    with pytest.raises(AssertionError):
        check_same(here.calls, there)


@pytest.mark.parametrize(
    "line", ["G2X10", "G1X1", "G2X10I5R5F9", "G0G28X1", "G10L2P1R5X", "G4", "G2X1Y1R.1F9", "G5.4X1", "M98"]
)
def test_what_both_refuse(lib: CDLL, tmp_path: Path, line: str) -> None:
    with pytest.raises(Refused):
        Ours(lib, XYZABC).run(line)
    with pytest.raises(Refused):
        rs274(line + "\nM2\n", tmp_path)
