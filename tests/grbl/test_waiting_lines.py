"""Lines that waited in a hold or behind an open door are read by a program that runs, never between two states."""

from __future__ import annotations

import pytest
from grbl_host import Grbl
from slow import slow_but

NEED_REST = ["$H", "$HX", "$110=123", "$C", "$SLP", "$RST=$", "$RST=*", "$J=G91Y3F1000", "$N0=G21", "$#", "$I", "$$"]


def resume(grbl: Grbl) -> str:
    """Until the first steps are out. (No spindle is on that a door would have to restore.)"""
    return grbl.after(0.2, "~")


@pytest.mark.alike(12)
@pytest.mark.parametrize("stop", slow_but("!".__eq__, ["!", "\x84"]))
@pytest.mark.parametrize("line", NEED_REST)
def test_a_line_that_waited_finds_the_program_running(grbl: Grbl, stop: str, line: str) -> None:
    """Grbl enters the cycle immediately: error:8, and the program's motion is done to its end."""
    grbl.fine("$22=1")
    grbl.after(0.3, "G1X-30F1000\n")
    said = grbl.after(1, stop) + grbl.after(0.5, line + "\n")
    assert "ok" not in said and "error" not in said
    assert resume(grbl) == "error:8\r\n"
    assert grbl.state() == "Run"
    assert "ALARM" not in grbl.send("") and grbl.state() == "Idle"
    assert grbl.position() == grbl.stands() == [-7500, 0, 0, 0, 0, 0]
    assert "$110=5000.000" in grbl.send("$$\n")


@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_the_next_move_is_the_programs(grbl: Grbl, stop: str) -> None:
    """`$100=` does not drop the rest, so the next G1 begins at the corner and cuts no diagonal."""
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.after(1, stop)
    grbl.after(0.5, "$100=500\nG1Y-5\n")
    said = resume(grbl)
    while grbl.stands()[1] == 0:
        said += grbl.after(0.01)
    assert grbl.stands()[0] == pytest.approx(-7500, abs=3)
    assert said == "error:8\r\nok\r\n"


@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_a_jog_cancel_leaves_the_programs_moves_alone(grbl: Grbl, stop: str) -> None:
    """A `$J=` that waited is refused, and `0x85` drops nothing of the program."""
    grbl.after(0.3, "G1X-30F1000\nY-5\n")
    grbl.after(1, stop)
    grbl.after(0.5, "$J=G91Z-3F1000\n")
    said = resume(grbl)
    said += grbl.send("\x85")
    assert said == "error:8\r\n" and grbl.position()[:3] == [-7500, -1250, 0] and grbl.state() == "Idle"


@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_sleep_does_not_come_while_it_cuts(grbl: Grbl, stop: str) -> None:
    """`$SLP` in mid-job: error:8, and a hold still holds."""
    grbl.after(0.3, "G1X-30F1200\n")
    grbl.after(1, stop)
    grbl.after(0.5, "$SLP\n")
    resume(grbl)
    grbl.after(0.5, "!")
    held = grbl.position()
    assert grbl.state() == "Hold:0" and grbl.after(5) == "" and grbl.position() == held


@pytest.mark.parametrize("line", ["$H", "$C", "$J=G91Y3F1000", "$100=500"])
def test_a_line_that_waited_in_a_dwell(grbl: Grbl, line: str) -> None:
    """A dwell that was held is a line of the program that is not done: it is not idle."""
    grbl.fine("$22=1")
    grbl.after(0.3, "G4P1\n")
    grbl.after(1, "!")
    grbl.after(0.5, line + "\n")
    assert grbl.after(0.1, "~") == "" and grbl.state() == "Run"
    # the dwell's ok, and then nothing is under way
    assert grbl.after(0.9).startswith("ok\r\n")


@pytest.mark.parametrize(("line", "answer"), [("$J=G91Y3F1000", "ok\r\n"), ("$#", "ok\r\n"), ("$100=300", "ok\r\n")])
@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_a_hold_with_nothing_under_way_resumes_to_idle(grbl: Grbl, stop: str, line: str, answer: str) -> None:
    """As Grbl: with an empty queue `~` leads to Idle, and what waited is done."""
    grbl.send(stop)
    assert grbl.after(0.5, line + "\n").replace("[MSG:Check Door]\r\n", "") == ""
    assert grbl.send("~").endswith(answer) and grbl.state() == "Idle"


def test_a_hold_that_waits_is_taken_back_by_resume(grbl: Grbl) -> None:
    """`!` while M53 P0 is in force waits; `~` takes it back, so that M53 P1 does not hold."""
    grbl.fine("M53P0")
    grbl.after(0.3, "G1X-10F1000\n")
    grbl.after(0.05, "!")
    assert grbl.state() == "Run"
    grbl.after(0.05, "~")
    assert grbl.send("M53P1\n") == "ok\r\n" and grbl.state() == "Idle" and grbl.position()[0] == -2500
