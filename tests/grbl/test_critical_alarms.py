"""After alarms 1, 2, 50, 51 and 52 only a reset leads on; until then the controller answers what it is asked."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from grbl_host import BANNER, LOCKED, Grbl

RESET = "[MSG:Reset to continue]\r\n"
RELEASE = "[MSG:Release the emergency stop]\r\n"


def hard_limit(grbl: Grbl) -> str:
    grbl.fine("$21=1")
    grbl.travel(0, -5000, 1000)
    return grbl.send("G1X20F3000\n").removeprefix("ok\r\n")


def soft_limit(grbl: Grbl) -> str:
    grbl.fine("$22=1", "$20=1")
    said = grbl.send("G1X-500F3000\n")
    assert said.endswith("error:9\r\n"), "the line under way has its answer, and it is not ok"
    return said.removesuffix("error:9\r\n")


def estop(grbl: Grbl) -> str:
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.input("estop", True)
    grbl.input("estop", False)
    return grbl.send("")


ALARMS = [pytest.param(hard_limit, 1, id="1"), pytest.param(soft_limit, 2, id="2"), pytest.param(estop, 50, id="50")]
Make = Callable[[Grbl], str]


@pytest.mark.parametrize(("make", "alarm"), ALARMS)
def test_it_answers_what_only_reads(grbl: Grbl, make: Make, alarm: int) -> None:
    """`?` and the questions are answered, so that a sender does not take the controller for dead."""
    assert make(grbl) == f"ALARM:{alarm}\r\n" + RESET
    assert grbl.status().startswith("<Alarm|MPos:")
    assert grbl.send("\n") == "ok\r\n"
    for line, part in (
        ("$", "[HLP:"),
        ("$$", "$0="),
        ("$G", "[GC:"),
        ("$#", "[G54:"),
        ("$I", "[VER:"),
        ("$I+", "[CAPS:"),
        ("$N", "$N0="),
    ):
        said = grbl.send(line + "\n")
        assert part in said and said.endswith("\r\nok\r\n"), line


@pytest.mark.parametrize(("make", "alarm"), ALARMS)
def test_it_refuses_all_else_and_only_a_reset_leads_on(grbl: Grbl, make: Make, alarm: int) -> None:
    """error:9 for each line, no motion, nothing stored, and the message is not repeated."""
    make(grbl)
    at, settings = grbl.stands(), grbl.send("$$\n")
    lines = ["$X", "$H", "$HX", "$J=G91X-1F100", "G0X0", "M3S100", "G10L2P1X5", "$C", "$SLP", "$RST=*", "$N0=G20"]
    for line in [*lines, "$I=ME", "$100=80"]:
        assert grbl.send(line + "\n") == "error:9\r\n", line
    assert grbl.send("~!\x84\x85\x91\x9e\xa0") == ""
    assert grbl.send("?" * 3).count("MSG") == 0
    assert grbl.stands() == at == grbl.position() and grbl.state() == "Alarm"
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    assert grbl.send("$$\n").replace("250.000", "") == settings.replace("250.000", "")
    said = grbl.send("\x18")
    assert re.fullmatch(re.escape(BANNER) + r"(\[MSG:Check Limits\]\r\n)?" + re.escape(LOCKED), said)
    assert grbl.send("$X\n").endswith("ok\r\n") and grbl.state() == "Idle"


def test_lines_that_wait_have_their_answers(grbl: Grbl) -> None:
    """Every line has exactly one answer, also those that came before the alarm and those in its quiet time."""
    job = "".join(f"G1X{x % 7}Y{x % 3}F600\n" for x in range(80))
    said = grbl.after(0.5, job)
    grbl.input("estop", True)
    said += grbl.after(0.1)
    said += grbl.after(0.1, "G0X1\n$$\n\n")
    grbl.input("estop", False)
    said += grbl.send("")
    answers = re.findall(r"^(ok|error:\d+)\r$", said, re.M)
    assert len(answers) == 83 and re.fullmatch(r"(ok )+(error:9 )+ok ok", " ".join(answers))


def test_a_reset_is_asked_for_only_when_it_helps(grbl: Grbl) -> None:
    """With the e-stop still pressed a reset ends in the same alarm: a program that resets at each `Reset to
    continue` (OpenBuilds CONTROL) would do so for ever."""
    grbl.input("estop", True)
    assert grbl.send("") == "ALARM:50\r\n" + RELEASE
    for _ in range(3):
        assert grbl.send("\x18") == BANNER + LOCKED + "ALARM:50\r\n" + RELEASE
    grbl.input("estop", False)
    assert grbl.after(1) == RESET
    assert grbl.send("\x18") == BANNER + LOCKED


@pytest.mark.parametrize("byte", ["!", "\x85"])
def test_a_cancel_in_it_hides_no_answer(grbl: Grbl, byte: str) -> None:
    """Real-time bytes mean nothing here: a jog that came with them is refused, and not passed as one called off."""
    grbl.input("estop", True)
    grbl.after(1)
    grbl.input("estop", False)
    grbl.after(1)
    assert grbl.send(f"$J=G91X-1F100\n{byte}") == "error:9\r\n"
