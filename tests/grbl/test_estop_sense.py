"""`$749`: the e-stop's contact opens when pressed, so that a cut wire stops the machine; or it closes."""

from __future__ import annotations

from pathlib import Path

import pytest
from grbl_host import BANNER, Grbl

OPEN_SINCE_START = "[MSG:E-stop open since start: close its contact, or see $749]\r\n"
RELEASE = "[MSG:Release the emergency stop]\r\n"


@pytest.fixture
def nothing_wired() -> Grbl:
    """The line is as with a contact that is open, from the start on."""
    grbl = Grbl()
    grbl.input("estop", True)
    return grbl


def test_an_open_line_since_start_is_an_alarm_with_a_hint(nothing_wired: Grbl) -> None:
    assert "ALARM:50\r\n" + OPEN_SINCE_START in nothing_wired.send("")
    assert nothing_wired.send("$X\n") == "error:9\r\n"
    assert nothing_wired.send("\x18").endswith(OPEN_SINCE_START), "a reset does not help"


def test_a_contact_that_was_closed_has_no_hint(grbl: Grbl) -> None:
    grbl.input("estop", True)
    assert grbl.send("") == "ALARM:50\r\n" + RELEASE


@pytest.mark.parametrize("state", ["", "M3S1000\n", "G1X50F600\n"])
def test_a_cut_wire_is_as_pressed(grbl: Grbl, state: str) -> None:
    grbl.after(0.3, state)
    grbl.input("estop", True)
    assert "ALARM:50\r\n" in grbl.send("")
    assert grbl.outputs().spindle_direction == 0


def test_the_sense_is_the_one_setting_that_leads_out(nothing_wired: Grbl) -> None:
    """All else stays refused, and so does this one in other critical alarms."""
    nothing_wired.send("")
    for line in ("$748=1", "$7490=1", "$749=", "$749=x", "$100=80", "$RST=$"):
        assert nothing_wired.send(line + "\n").startswith("error:"), line
    assert nothing_wired.send("$749=1\n").startswith("ok\r\n")
    assert nothing_wired.send("\x18").startswith(BANNER)
    assert nothing_wired.send("$X\n").endswith("ok\r\n")
    assert nothing_wired.state() == "Idle"


def test_another_critical_alarm_keeps_it(grbl: Grbl) -> None:
    grbl.fine("$21=1")
    grbl.travel(0, -5000, 1000)
    assert "ALARM:1" in grbl.send("G1X20F3000\n")
    assert grbl.send("$749=1\n") == "error:9\r\n"


def test_a_normally_open_contact_stops_when_it_closes(nothing_wired: Grbl) -> None:
    nothing_wired.send("")
    nothing_wired.send("$749=1\n")
    nothing_wired.send("\x18")
    assert nothing_wired.send("$X\n").endswith("ok\r\n")
    nothing_wired.input("estop", False)
    assert "ALARM:50\r\n" + RELEASE in nothing_wired.send("")
    nothing_wired.input("estop", True)
    assert nothing_wired.send("") == "[MSG:Reset to continue]\r\n"


def test_it_is_stored(tmp_path: Path) -> None:
    grbl = Grbl(store=tmp_path / "store")
    assert "ok\r\n" in grbl.send("$749=1\n")
    assert grbl.state() == "Alarm", "its contact rests closed"
    again = Grbl(store=tmp_path / "store")
    assert "ALARM:50\r\n" in again.send("")
    assert again.send("$749=0\n").startswith("ok\r\n")
    assert again.send("\x18").startswith(BANNER)
