"""What a program says to the operator: (MSG,…), (PRINT,…), (DEBUG,…), and the comment of a pause."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("(MSG, Turn the part over)", "Turn the part over"),
        ("(msg,probe)G0X1", "probe"),
        ("G0X1 ( PRINT,[a|b])", "(a/b)"),
        ("(DEBUG, x)", "x"),
        ("; MSG, after a semicolon", "after a semicolon"),
        ("(MSG," + "long " * 30 + ")", ("long " * 30)[: 80 - 4].strip()),
    ],
)
def test_a_message_is_shown(grbl: Grbl, line: str, text: str) -> None:
    assert grbl.send(line + "\n") == f"[MSG:{text}]\r\nok\r\n"


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("(DEBUG,#5220)", "1.000000"),
        ("(PRINT,x=#<_x>)", "x=2.500000"),
        ("; print, tool #<_current_tool> at #5420,#5421", "tool 0.000000 at 2.500000,0.000000"),
        ("(DEBUG,%d#5220 of %.2f#<_x>, %f#1 %lf#2)", "1 of 2.50, -3.2500 7.000000"),
        ("(DEBUG,%.9f#1)", "-3.250000"),
        ("(PRINT,#<My Name>|#<myname>)", "4.000000/4.000000"),
        ("(PRINT,#<unset> #70000 #5001 #99999999999)", "###### ###### ###### ######"),
        ("(PRINT,100% #x # #0 #<open %.f %.xf)", "100% #x # #0 #<open %.f %.xf"),
        ("(PRINT,##1)", "#-3.250000"),
        ("(PRINT,#" + "<" + "n" * 40 + ">)", "#<" + "n" * 40 + ">"),
        ("(MSG,#5220 %d)", "#5220 %d"),
        ("M0 (see #5220)", "see #5220"),
    ],
)
def test_values_take_the_place_of_parameters(grbl: Grbl, line: str, text: str) -> None:
    """In PRINT and DEBUG alone, with six decimals unless a format says otherwise (LinuxCNC, Parameters in special
    comments); a name that nothing has set is ######."""
    grbl.send("#1=-3.25 #2=7 #<my name>=4\nG0X2.5\n")
    grbl.after(1)
    assert grbl.send(line + "\n").startswith(f"[MSG:{text}]\r\n")


def test_a_value_is_that_before_the_line(grbl: Grbl) -> None:
    """Comments are executed first (LinuxCNC, Order of execution)."""
    grbl.send("#1=1\n")
    assert grbl.send("#1=2 (DEBUG,%d#1)\n(DEBUG,%d#1)\n") == "[MSG:1]\r\nok\r\n[MSG:2]\r\nok\r\n"


@pytest.mark.parametrize("line", ["(a comment)G0X1", "(MSGS, no)", "(see MSG,)", "(MSG)", "(MSG,)", "G0X1"])
def test_other_comments_are_not(grbl: Grbl, line: str) -> None:
    assert grbl.send(line + "\n") == "ok\r\n"


def test_letters_of_a_message_are_no_commands(grbl: Grbl) -> None:
    """Those beyond ASCII are shown as ?."""
    assert grbl.send("(MSG,Gr\xc3\xb6\xc3\x9fe \xc3\x84)\n") == "[MSG:Gr??e ?]\r\nok\r\n"


@pytest.mark.parametrize(
    ("line", "text"), [("M0 (turn it)", "turn it"), ("M0(MSG,turn)", "turn"), ("M00;clamp", "clamp")]
)
def test_the_comment_of_a_pause_is_shown_once(grbl: Grbl, line: str, text: str) -> None:
    assert grbl.send(line + "\n") == f"[MSG:{text}]\r\n"
    assert grbl.state() == "Hold:0"
    assert grbl.send("~") == "ok\r\n"


def test_a_pause_says_so_where_it_is(grbl: Grbl) -> None:
    grbl.after(0.1, "G1X10F600\n")
    assert "MSG" not in grbl.after(0.1, "M0 (look)\n")
    assert "[MSG:look]" in grbl.after(3) and grbl.state() == "Hold:0"


def test_an_optional_pause_that_passes_says_nothing(grbl: Grbl) -> None:
    assert grbl.send("M1 (look)\n") == "ok\r\n"
    grbl.send("\x88")
    assert grbl.send("M1 (look)\n") == "[MSG:look]\r\n" and grbl.send("~") == "ok\r\n"
