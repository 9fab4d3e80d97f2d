"""$93: the program waits behind the M7 or M8 that switches air assist or coolant on."""

from __future__ import annotations

import pytest
from grbl_host import Grbl

DELAY_S = 1.5
SLACK_S = 0.1  # until the first step of a move is seen
MOVE = "G91G1X-20F1200\n"


def waits_s(grbl: Grbl, lines: str, seconds: float) -> None:
    """The move behind these lines begins after this time."""
    before = grbl.stands()
    if seconds > 0:
        grbl.after(seconds - SLACK_S, lines + MOVE)
        assert grbl.stands() == before
        assert grbl.state() != "Alarm"
        grbl.after(2 * SLACK_S)
    else:
        grbl.after(SLACK_S, lines + MOVE)
    assert grbl.stands() != before


@pytest.mark.parametrize("mode", ["$32=1\nM4S500\n", "$32=0\nM3S500\n"])
def test_what_follows_waits(grbl: Grbl, mode: str) -> None:
    """With a laser and with a spindle; coolant is on while it waits, and a beam is not."""
    grbl.fine(f"$93={DELAY_S}", *mode.split())
    before = grbl.stands()
    grbl.after(DELAY_S - SLACK_S, "M8\n" + MOVE)
    assert grbl.stands() == before and grbl.outputs().coolant == 2
    assert (grbl.outputs().spindle_duty > 0) == ("M3" in mode)
    grbl.after(2 * SLACK_S)
    assert grbl.stands() != before and grbl.outputs().spindle_duty > 0


def test_a_move_of_the_same_line_waits(grbl: Grbl) -> None:
    grbl.fine(f"$93={DELAY_S}", "$32=1", "M3S500", "G91F1200")
    before = grbl.stands()
    grbl.after(DELAY_S - SLACK_S, "M8G1X-20\n")
    assert grbl.stands() == before
    grbl.after(2 * SLACK_S)
    assert grbl.stands() != before


@pytest.mark.parametrize("lines", ["", "M9\n", "M8\n", "M3S100\n", "S700\n"])
@pytest.mark.parametrize("laser", [0, 1])
def test_only_where_something_is_switched_on(grbl: Grbl, laser: int, lines: str) -> None:
    """It is on already, or goes off: nothing waits."""
    grbl.fine(f"$32={laser}", f"$93={DELAY_S}", "M8")
    waits_s(grbl, lines, 0)


def test_default_is_no_wait(grbl: Grbl) -> None:
    waits_s(grbl, "M8\n", 0)


def test_a_dwell_of_the_line_comes_behind_it(grbl: Grbl) -> None:
    grbl.fine(f"$93={DELAY_S}")
    waits_s(grbl, "M8G4P1\n", DELAY_S + 1)


def test_a_reset_ends_it(grbl: Grbl) -> None:
    grbl.fine("$93=60")
    grbl.after(0.2, "M8\n")
    grbl.after(0.2, "\x18")
    assert grbl.outputs().coolant == 0
    waits_s(grbl, "", 0)


def test_a_hold_stops_it(grbl: Grbl) -> None:
    """As G4: the time does not run in a hold."""
    grbl.fine(f"$93={DELAY_S}")
    before = grbl.stands()
    grbl.after(0.5, "M8\n" + MOVE)
    grbl.after(5.0, "!")
    assert grbl.state() == "Hold:0" and grbl.stands() == before
    grbl.after(0.8, "~")
    assert grbl.stands() == before
    grbl.after(0.4)
    assert grbl.stands() != before


def test_check_mode_does_not_wait(grbl: Grbl) -> None:
    grbl.fine("$93=60")
    assert grbl.send("$C\n") == "[MSG:Enabled]\r\nok\r\n"
    assert grbl.after(0.2, "M8\n" + MOVE) == "ok\r\nok\r\n"


@pytest.mark.parametrize("line", ["$93=60.1", "$93=70"])
def test_out_of_range(grbl: Grbl, line: str) -> None:
    assert grbl.send(line + "\n") == "error:2\r\n"
