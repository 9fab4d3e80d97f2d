"""Checklist 4.5b: error numbers are the contract with senders. Each is shown with the line that earns it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from grbl_host import Grbl

ROOT = Path(__file__).parents[2]

# what the checklist says | lines before | the line
CAUSES = [
    ("1 letter expected", [], "?1"),
    ("1 letter expected", [], "1"),
    ("2 bad number", [], "X1Y"),
    ("3 unknown `$` command", [], "$999=1"),
    ("4 negative value", [], "S-1"),
    ("5 homing disabled", [], "$H"),
    ("6 step pulse < 3 us", [], "$0=2"),
    ("8 needs Idle (or Alarm)", ["$C"], "$H"),
    ("9 locked by alarm/jog", ["$SLP", "\x18"], "G0"),
    ("10 soft limits need homing", [], "$20=1"),
    ("11 line too long", [], "G0X" + "0" * 254),
    ("14 stored line too long", [], "$N0=G0X" + "0" * 77),
    ("13 door open", ["$SLP", "\x18", "door"], "$X"),
    ("15 jog beyond travel", ["$22=1", "$20=1"], "$J=X1F100"),
    ("16 jog word not allowed", [], "$J=X1F100M3"),
    ("20 unsupported code/word", [], "G0Q1E1"),
    ("21 two of one modal group", [], "G17G18"),
    ("22 no feed", [], "G1X1"),
    ("23 integer expected", [], "G1.5"),
    ("24 two axis-word commands", [], "G0G92X1"),
    ("25 word twice", [], "G0X1X2"),
    ("26 no axis words", [], "G92"),
    ("27 line number", [], "N10000001"),
    ("28 missing value word", [], "G4"),
    ("29 WCS above G59", [], "G10L2P99X0"),
    ("30 G53 motion mode", ["F100"], "G53G2X1Y1I1"),
    ("31 axis words unused", [], "G80X1"),
    ("32 arc without plane axis", ["F100"], "G2Z1R1"),
    ("33 target impossible", ["F100"], "G2X10Y0I4"),
    ("34 radius impossible", ["F100"], "G2X1Y0R0.1"),
    ("35 no plane offset", ["F100"], "G2X1Y1"),
    ("36 unused words", [], "G0X1P1"),
    ("37 G43.1 axis", [], "G43.1X1"),
    ("38 tool number", [], "T256"),
]


NEEDS = {"$0=2": ("no own pulse of 2 us",), "$X": ("door",)}  # of a board (needs.py)
ROWS = [pytest.param(*row, marks=[pytest.mark.needs(*NEEDS[row[2]])] if row[2] in NEEDS else []) for row in CAUSES]


@pytest.mark.parametrize(("says", "before", "line"), ROWS, ids=[row[0] + " " + row[2][:12] for row in CAUSES])
def test_every_error_has_its_cause(grbl: Grbl, says: str, before: list[str], line: str) -> None:
    """Numbers are the contract; an error changes nothing."""
    for step in before:
        if step == "door":
            grbl.input("door", True)
        else:
            grbl.send(step if step == "\x18" else step + "\n")
    place = grbl.position()
    said = re.sub(r"<.*>\r\n", "", grbl.send(line + "\n"))  # the answer to a ? comes when it comes
    assert said[said.find("error") :] == f"error:{says.split()[0]}\r\n"
    assert grbl.position() == place


UNUSED = """12 step rate setting too high (build option): a rate is clamped and said instead."""


PWM = 2  # BOARD_OUTPUT_PWM


def test_a_laser_on_a_relay() -> None:
    """17 laser needs PWM: a board that only switches the spindle refuses $32, and has it off."""
    grbl = Grbl(lacks=PWM)
    grbl.send("")
    assert grbl.send("$32=1\n") == "error:17\r\n" and grbl.send("$32=0\n") == "ok\r\n"
    assert "$32=0\r\n" in grbl.send("$$\n")
    grbl.close()


def test_numbers_that_are_not_used() -> None:
    """One of Grbl's numbers keeps its meaning and is never given."""
    table = (ROOT / "core/gcode/status.h").read_text(encoding="utf-8")
    names = {int(n): name for n, name in re.findall(r"X\((\d+), ([A-Z0-9_]+),", table)}
    used = {int(row[0].split()[0]) for row in CAUSES} | {0, 7, 17}
    grbl_numbers = {n for n in names if n <= 38}
    assert grbl_numbers - used == {12} == {int(n) for n in re.findall(r"^(\d+) [a-z]", UNUSED)}
    core = [path.read_text(encoding="utf-8") for path in (ROOT / "core").rglob("*.c")]
    assert not any(re.search(rf"\bSTATUS_{names[12]}\b", text) for text in core)
