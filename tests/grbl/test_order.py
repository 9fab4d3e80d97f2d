"""Checklist 4.3: the order in which the words of one line take effect."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


def test_a_line_takes_effect_in_one_order(grbl: Grbl) -> None:
    """Order in a block: feed mode, F, S, T, spindle, coolant, override, dwell, plane, units, WCS, path, distance, then
    G10/G28/G92..., motion, then stop. However the words stand in the line."""
    line = "M0 X1 G1 G91 G55 G20 M8 M3 T2 S400 F10 G94"
    words = line.split()
    for turned in (words, words[::-1], words[5:] + words[:5]):
        grbl.send("\x18")
        grbl.fine("G0X0", "G10L2P2X0")
        assert grbl.send("".join(turned) + "\n") == ""
        assert grbl.position()[0] == round(25.4 * 250) and grbl.state() == "Hold:0"  # motion, then stop
        assert (grbl.outputs().spindle_rpm, grbl.outputs().coolant) == (400, 2)
        assert grbl.send("~") == "ok\r\n"
        assert "[GC:G1 G55 G17 G20 G91 G94 M3 M8 T2 F254 S400]" in grbl.send("$G\n")


def test_spindle_and_coolant_come_before_the_dwell(grbl: Grbl) -> None:
    """... S, T, spindle, coolant, override, dwell ...: the spindle turns while the line dwells."""
    assert grbl.after(0.1, "G4P1M3S400M8\n") == ""
    assert (grbl.outputs().spindle_rpm, grbl.outputs().coolant) == (400, 2)


def test_units_and_wcs_come_before_motion(grbl: Grbl) -> None:
    """... units, WCS, path, distance, then G10/G28/G92..., motion: the line's own units and offsets count."""
    grbl.fine("G10L2P2X10", "X1G0G55G20")
    assert grbl.position()[0] == round(35.4 * 250)


@pytest.mark.parametrize(("line", "x"), [("G92.1G0X1", 1), ("G0X1G92.1", 1)])
def test_offsets_come_before_motion(grbl: Grbl, line: str, x: int) -> None:
    """... then G10/G28/G92..., motion: G92.1 clears the offset before the move of its line."""
    grbl.fine("G92X5", line)
    assert "G92:0.000" in grbl.send("$#\n")
    assert grbl.position()[0] in (x * 250, (x - 5) * 250)
