"""Expressions and parameters on the running controller: docs/gcode-programs.md over a stream. Virtual time."""

from __future__ import annotations

from pathlib import Path

import pytest
from grbl_host import BANNER, Grbl
from wificnc.connection.words import ERRORS

STEPS_MM = 250
NUMBER = {words: number for number, words in ERRORS.items()}


def mm(grbl: Grbl) -> list[float]:
    return [steps / STEPS_MM for steps in grbl.position()[:3]]


def error(beginning: str) -> str:
    """The answer with these words."""
    (number,) = (number for words, number in NUMBER.items() if words.startswith(beginning))
    return f"error:{number}\r\n"


def test_a_computed_line_moves(grbl: Grbl) -> None:
    grbl.fine("#1 = 8", "#<depth> = [#1 / 4 + 1]", "G1 X#1 Y[1 + 2 * 3] Z-#<depth> F[60 * 20]")
    assert mm(grbl) == [8, 7, -3]


def test_a_setting_takes_effect_after_the_line(grbl: Grbl) -> None:
    grbl.fine("#3=15", "F6000", "#3=6 G1 X#3", "Y#3")
    assert mm(grbl) == [15, 6, 0]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("X[1/0]", "an expression divides by zero"),
        ("X#<nobody>", "this named parameter has no value yet"),
        ("#5420=3", "this parameter is read-only"),
        ("X#9000", "the parameter number does not exist"),
        ("X[1+", "a number is missing"),
        ("X[1", "a bracket of an expression is missing"),
        ("X[1 FOO 2]", "an expression has an operator"),
        ("O100 sub", "O words cannot run in a stream"),
        ("o<name> call [1]", "O words cannot run in a stream"),
        ("N10 o1 while [#1 LT 3]", "O words cannot run in a stream"),
        ("G1 X[1] F100 #1=2 #1", "a parameter at the beginning of a word needs"),
        ("G999 X#1", "unsupported code or word"),
        ("$J=G91 X#1 F100", "a number is missing"),
        ("X[200000 * 2]", "the target of the motion is invalid"),
    ],
)
def test_errors_have_no_effect(grbl: Grbl, line: str, words: str) -> None:
    grbl.fine("#1=5", "G0 X1")
    assert grbl.send(line + "\n") == error(words)
    grbl.fine("G0 Y#1")
    assert mm(grbl) == [1, 5, 0]


def test_a_slash_divides_only_in_a_computed_line(grbl: Grbl) -> None:
    """Without an expression it is Grbl's: dropped. A line that begins with it is not deleted."""
    grbl.fine("/G0 X4/2", "/#1=[6/4] G0 Y2", "G0 Z#1")
    assert mm(grbl) == [42, 2, 1.5]
    assert grbl.send("#1=#1/2\n") == error("a letter was expected here")


def test_reset_clears_and_the_end_of_a_program_does_not(grbl: Grbl) -> None:
    grbl.fine("#1=5", "#40=6", "#<a>=7")
    assert grbl.send("M2\n") == "[MSG:Pgm End]\r\nok\r\n"
    grbl.fine("G0 X#1 Y#40 Z#<a>")
    assert mm(grbl) == [5, 6, 7]
    assert grbl.send("\x18") == BANNER
    grbl.fine("G0 X#1 Y#40")
    assert mm(grbl) == [0, 0, 7]
    assert grbl.send("Z#<a>\n") == error("this named parameter has no value yet")


def test_what_the_machine_knows(grbl: Grbl) -> None:
    grbl.fine("G10 L2 P1 X3", "G0 X10", "G0 Y#5420 Z[#<_abs_x> / 2]")
    assert mm(grbl) == [13, 10, 6.5]


def test_probe_result(grbl: Grbl) -> None:
    """#5061 .. in the work coordinates of the probe's line, exact to the step; #5070 says whether it touched."""
    grbl.fine("G10 L2 P1 Z-1", "G10 L2 P2 Z-2", "F120", "G0 Z10")
    grbl.surface(round(-5 * STEPS_MM))
    assert "[PRB:0.000,0.000,-5.000:1]" in grbl.send("G55 G38.2 Z-20\n")
    grbl.fine("#1=#5063 #2=#5070", "G54 G0 Z10", "G0 X[#1*-1] Y#2")
    assert mm(grbl) == [3, 1, 9]
    assert "[PRB:0.000,0.000,-5.000:1]" not in grbl.send("G38.3 Z8\n")
    grbl.fine("G0 Y[#5070 + 7]")
    assert mm(grbl)[1] == 7


def test_a_startup_line_may_compute(tmp_path: Path) -> None:
    grbl = Grbl(store=tmp_path / "store")
    grbl.send("")
    grbl.fine("$N0=#1=5#<_a1>=[1/2]", "G0 X#1 Y#<_a1>")
    assert mm(grbl) == [5, 0.5, 0]
    assert grbl.send("$N1=#1=[1/0]\n") == error("an expression divides by zero")
    assert ">#1=5#<_A1>=[1/2]:ok" in grbl.send("\x18")
    grbl.fine("G0 Z#1")
    assert mm(grbl)[2] == 5
    grbl.close()


def test_check_mode_computes(grbl: Grbl) -> None:
    assert "Enabled" in grbl.send("$C\n")
    grbl.fine("#1=5", "G0 X[#1*2]", "#2=#5420")
    assert grbl.send("X[1/[#2-10]]\n") == error("an expression divides by zero")
