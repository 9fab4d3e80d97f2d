"""The answers of Grbl 1.1h, row by row: each id quotes the row it comes from."""

from __future__ import annotations

from ctypes import CDLL

import pytest
from gcode_core import Controller

OK = 0

# (quoted row, lines, answer to the last line)
G_CODE_CHECKS = [
    ("`G1X1`, no F yet: error:22", ["G1X1"], 22),
    ("`G2X1Y0R0.1`: 34", ["F100", "G2X1Y0R0.1"], 34),
    ("`G2X1Y1F1e4` no IJK: 35", ["G2X1Y1F10000"], 35),
    ("arc off radius: 33", ["F100", "G2X10Y0I4"], 33),
    ("`G80X1`: 31", ["G80X1"], 31),
    ("`G53` with arc: 30", ["F100", "G53G2X1Y1I1"], 30),
    ("`G53` with probe: 30", ["F100", "G53G38.2Z-1"], 30),
    ("`G38.2` of zero length: 33", ["F100", "G38.2Z0"], 33),
    ("`G43.1` on X: 37", ["G43.1X1"], 37),
    ("`G1.5`: 23", ["G1.5"], 23),
    ("`G54.1`: 23", ["G54.1"], 23),
    ("`G21.5`: 23", ["G21.5"], 23),
    *((f"`{code}`: 20", [code], 20) for code in ["G96", "M56"]),
    *((f"{word} word: 20", [f"G0{word}1"], 20) for word in "ABH"),
    ("`F0`, then `G1`: F0 ok", ["F0"], OK),
    ("`F0`, then `G1`: then 22", ["F0", "G1"], 22),
    ("`G0X1X2`: 25", ["G0X1X2"], 25),
    ("`G0G1X1`: 24", ["G0G1X1"], 24),
    ("`G17G18`: 21", ["G17G18"], 21),
    ("`G55G54`: 21", ["G55G54"], 21),
    ("`G10L2P7`: 29; ours has P1..P9", ["G10L2P10"], 29),
    ("`G10L2P7`, with an axis: 29; ours has P1..P9", ["G10L2P10X0"], 29),
    ("`G10L2P1`, no axis: 26", ["G10L2P1"], 26),
    ("`G92`, no axis: 26", ["G92"], 26),
    ("`G10P1X0` (no L): 20", ["G10P1X0"], 20),
    ("`G10L2X0` (no P): ok", ["G10L2X0"], OK),
    ("`G4`: 28", ["G4"], 28),
    ("`G4P-1`: 4", ["G4P-1"], 4),
    ("`G4P0`: ok", ["G4P0"], OK),
    *((f"`{word}` alone: 36", [word], 36) for word in ["P1", "L2", "I1", "K1", "R1"]),
    ("`S` negative: 4", ["S-1"], 4),
    ("`F` negative: 4", ["F-1"], 4),
    ("`T256`: 38", ["T256"], 38),
    ("`T1.5` ok (truncated)", ["T1.5"], OK),
    ("`G93G1X1` no F in the block: 22", ["F100", "G93G1X1"], 22),
    ("`G0` with no axis is ok", ["G0"], OK),
    ("`G1` alone while F=0 is error:22 (feed is checked before axes)", ["G1"], 22),
]

CHARACTERS_AND_NUMBERS = [
    ("An empty line answers `ok`", [""], OK),
    ("`%` is not special in Grbl: error:1; ours takes a lone % as the mark of a program's ends", ["%"], OK),
    ("`%` is not special in Grbl: error:1, with words after it", ["%G0"], 1),
    ("`X+1` ok", ["X+1"], OK),
    ("`X--1` error:2", ["X--1"], 2),
    ("one decimal point (`X1.2.3` error:1)", ["X1.2.3"], 1),
    ("no exponent (`X1e2` error:20, since E is a word)", ["X1E2"], 20),
    ("`N`: > 10,000,000 error:27", ["N10000001"], 27),
    ("`N`: 10,000,000 is the largest", ["N10000000"], OK),
    ("`N` negative error:4", ["N-1"], 4),
    ("`N` alone is ok", ["N7"], OK),
    ("`*` error:1 (no checksums)", ["N1G0X1*55"], 1),
    ("`#` error:1", ["#1=2"], 1),
    ("`[` error:1", ["[1]"], 1),
]

# Not in the table; what follows from Grbl's order of checks (gcode.c, read, not copied).
FOLLOWS = [
    ("a letter without a number", ["X"], 2),
    ("a point alone is no number", ["X."], 2),
    ("an expression where a number belongs", ["X[1+2]"], 2),
    ("words after a good one are still read", ["G0X1Y"], 2),
    ("G38 without a variant", ["G38Z1"], 20),
    ("G38 with an unknown variant", ["G38.6Z1"], 20),
    ("G28 with an unknown variant", ["G28.2"], 20),
    ("M with a fraction, known or not", ["M99.5"], 23),
    ("a negative code", ["G-1"], 20),
    ("a code of many digits", ["G" + "9" * 30], 2),
    ("a code of 10000", ["G10000"], 20),
    ("M codes and G codes do not mix", ["M21"], 20),
    ("two coolant words", ["M7M8"], 21),
    ("G10 and G92 want the same axes", ["G10G92X1"], 24),
    ("G28 and G1 want the same axes", ["G28G1X1"], 24),
    ("G28.1 wants none", ["G28.1G0X1"], OK),
    ("G92.1 and motion", ["G92.1G0X1"], OK),
    ("G4 and motion", ["G4P0G0X1"], OK),
    ("G4 and G92.1 are of one group", ["G4P0G92.1"], 21),
    ("a repeated word before a negative one", ["S1S-1"], 25),
    ("T is checked before repetition", ["T1T256"], 38),
    ("T255 is the largest", ["T255"], OK),
    ("a missing plane axis", ["F1", "G2Z1R1"], 32),
    ("a missing plane axis, and no centre", ["F1", "G2Z1"], 32),
    ("no offset of the plane", ["F1", "G2X1K1"], 35),
    ("R with I is an unused I", ["F1", "G2X1R1I1"], 36),
    ("R to where we are", ["F1", "G2X0R1"], 33),
    ("R around in the plane, but up", ["F1", "G2X0Z1R1"], 33),
    ("G43.1 without Z", ["G43.1"], 37),
    ("G10 L3", ["G10L3P1X0"], 20),
    ("G10 L2 with R", ["G10L2P1X0R1"], 20),
    ("G10 alone", ["G10"], 26),
    ("G10 X alone", ["G10X1"], 28),
    ("G10 cuts fractions", ["G10L2.9P1.9X1"], OK),
    ("G38 without axes", ["F1", "G38.2"], 26),
    ("G80 forbids axes to motion", ["G80", "G43X0H1"], 31),
    ("G53 after G80", ["G80G53"], 30),
    ("L beyond any integer", ["G10L99999999999P1X0"], 20),
    ("P beyond any integer", ["G10L2P99999999999X0"], 29),
]

# What is ours: intended deviations and codes that Grbl 1.1h lacks.
OURS = [
    ("G64", ["G64"], OK),
    ("G64 P", ["G64P0.01"], OK),
    ("G64's P cannot be negative", ["G64P-0.01"], 4),
    ("G61 takes no P", ["G61P1"], 36),
    ("G61.1", ["G61.1"], OK),
    ("G90.1 needs both offsets", ["F1", "G90.1G2X1I0.5"], 35),
    ("G90.2", ["G90.2"], 20),
    ("M1", ["M1"], OK),
    ("M7", ["M7"], OK),
    ("the axis words next to G49 are of the motion", ["G49Z1"], OK),
    ("G49 and G0", ["G49G0Z1"], OK),
    ("a head with G0, G49 and G80", ["G0G17G40G49G80G90"], OK),
    ("G80 leaves the motion", ["G81Z-1R0F9", "G0G80X1"], OK),
    ("G80 leaves the motion, the other way round", ["G1G80X1F9"], OK),
    ("G80 twice", ["G80G80"], 21),
    ("two motions and G80", ["G80G0G1"], 21),
    ("two codes without axis words", ["G0G28"], OK),
    ("two codes with axis words, which come first", ["X1G0G92"], 24),
    ("two codes with an axis word, which comes last", ["G0G92F1A1"], 24),
    ("after G80: G92", ["G80", "G92X0"], OK),
    ("after G80: G10", ["G80", "G10L20P1Y0"], OK),
    ("after G80: G28 and G30", ["G80", "G28Z0", "G30Z0"], OK),
    ("after G80: G43.1", ["G80", "G43.1Z1"], OK),
    ("with G80: G92", ["G80G92X0"], OK),
    ("after G80: an axis word alone", ["G80", "X1"], 31),
    ("scaling, rotation and polar coordinates off", ["G15G40G50G69G80"], OK),
    ("G50 of a lathe: coordinates", ["G50X1"], 20),
    ("G50 of a lathe: a limit of the speed", ["G50S2000"], 20),
    ("G51, G68, G16", ["G51X1"], 20),
    ("a circle without axis words", ["F100", "G2I1"], OK),
    ("a circle without axis words in the next line", ["F100", "G2I1", "I1"], 36),
    ("a helix with Z alone", ["F1", "G2Z1I1"], OK),
    ("turns", ["F1", "G2X0I1P3"], OK),
    ("no turn", ["F1", "G2X0I1P0"], 2),
    ("half a turn", ["F1", "G2X0I1P1.5"], 23),
    ("turns up to 1000", ["F1", "G2X0I1P1000"], OK),
    ("more turns", ["F1", "G2X0I1P1001"], 2),
    ("negative turns", ["F1", "G2X0I1P-1"], 4),
    ("turns of a line", ["F1", "G1X0P2"], 36),
    ("P of G64 next to an arc", ["F1", "G64P.1G2X0I1"], OK),
    ("G64 with Q", ["G64P.1Q.05"], OK),
    ("G64 with Q alone", ["G64Q.05"], OK),
    ("Q of nothing", ["G61Q1"], 20),
    ("hex", ["X0X10"], 25),
    ("not a number", ["XNAN"], 2),
    ("infinity", ["XINF"], 2),
    ("1e18", ["F" + "1" + "0" * 18], 2),
    ("just below 1e18", ["F" + "9" * 18], OK),
    ("leading zeros are not digits", ["X" + "0" * 60 + "1"], OK),
]


def _cases(*tables: list[tuple[str, list[str], int]]) -> list[object]:
    return [pytest.param(lines, answer, id=quote) for table in tables for quote, lines, answer in table]


@pytest.mark.parametrize(("lines", "answer"), _cases(G_CODE_CHECKS, CHARACTERS_AND_NUMBERS, FOLLOWS, OURS))
def test_answer(cnc: Controller, lines: list[str], answer: int) -> None:
    before = bytes(cnc.state)
    assert cnc.answer(*lines) == answer
    if answer and len(lines) == 1:
        assert bytes(cnc.state) == before


def test_all_missing_axes_are_error_20(lib: CDLL) -> None:
    for machine_axes in range(64):
        cnc = Controller(lib, machine_axes)
        for bit, letter in enumerate("XYZABC"):
            assert cnc.answer(f"G0{letter}1") == (OK if machine_axes >> bit & 1 else 20)
