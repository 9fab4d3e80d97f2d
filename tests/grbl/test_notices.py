"""A client that comes later learns why the machine is locked or held: when it connects, and by `$I`."""

from __future__ import annotations

import pytest
from grbl_host import Grbl
from test_critical_alarms import ALARMS, Make

WAY_OUT = "'$H'|'$X' to unlock"


def asked(grbl: Grbl) -> list[str]:
    """The messages of `$I`."""
    said = grbl.send("$I\n").split("\r\n")
    assert said[-2] == "ok"
    return [line.removeprefix("[MSG:").removesuffix("]") for line in said if line.startswith("[MSG:")]


@pytest.mark.parametrize(("make", "alarm"), ALARMS)
def test_a_critical_alarm_and_what_ends_it(grbl: Grbl, make: Make, alarm: int) -> None:
    make(grbl)
    assert grbl.notice() == f"Locked by ALARM:{alarm}: reset to continue"
    assert asked(grbl) == [grbl.notice()]


def test_an_estop_that_is_pressed(grbl: Grbl) -> None:
    grbl.input("estop", True)
    grbl.send("")
    assert grbl.notice() == "Locked by ALARM:50: release the emergency stop"
    grbl.input("estop", False)
    grbl.send("")
    assert grbl.notice() == "Locked by ALARM:50: reset to continue"


def test_an_alarm_that_unlocks(grbl: Grbl) -> None:
    grbl.send("G38.2Z-1F600\n")
    assert grbl.notice() == f"Locked by ALARM:5: {WAY_OUT}"
    assert asked(grbl) == [grbl.notice()]
    grbl.send("$X\n")
    assert grbl.notice() is None
    assert asked(grbl) == []


def test_homing_is_required_after_a_reset(grbl: Grbl) -> None:
    grbl.fine("$22=1")
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.send("\x18")
    assert grbl.notice() == f"Locked by ALARM:3: {WAY_OUT}"
    grbl.send("\x18")
    assert grbl.notice() == f"Locked since start or reset: {WAY_OUT}"


def test_a_limit_switch_that_is_closed_at_the_reset(grbl: Grbl) -> None:
    grbl.fine("$21=1")
    grbl.input("limit-x", True)
    grbl.send("\x18")
    assert grbl.notice() == "Locked by ALARM:1: reset to continue"
    grbl.send("\x18")
    assert grbl.notice() == f"Locked, check limits: {WAY_OUT}"


def test_a_program_that_waits_for_somebody(grbl: Grbl) -> None:
    grbl.send("G1X1F1000\nM0\n")
    assert grbl.notice() == "Program pause"
    grbl.send("~")
    assert grbl.notice() is None
    grbl.send("T4M6\n")
    assert grbl.notice() == "Tool change: T4"
    grbl.send("~")
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.send("!")
    assert grbl.state() == "Hold:0"
    assert grbl.notice() is None, "a feed hold is a state that needs no more words"


def test_nothing_to_tell(grbl: Grbl) -> None:
    assert grbl.notice() is None
    assert asked(grbl) == []
