"""A client that comes later learns why the machine is locked or held: when it connects, and by `$I`."""

from __future__ import annotations

import pytest
from c_library import LIB
from grbl_host import Grbl
from layouts import HOST
from test_critical_alarms import ALARMS, Make

WAY_OUT = "'$H'|'$X' to unlock"


def asked(grbl: Grbl) -> list[str]:
    """The messages of `$I`."""
    said = grbl.send("$I\n").split("\r\n")
    assert said[-2] == "ok"
    return [line.removeprefix("[MSG:").removesuffix("]") for line in said if line.startswith("[MSG:")]


def notice(grbl: Grbl) -> str | None:
    """By `$I`. A client that connects reads the same; a chip's UART has no connection."""
    found = [*asked(grbl), None]
    if isinstance(grbl, Grbl):
        assert [*grbl.notices(), None] == found
    assert len(found) <= 2
    return found[0]


@pytest.mark.parametrize(("make", "alarm"), ALARMS)
def test_a_critical_alarm_and_what_ends_it(grbl: Grbl, make: Make, alarm: int) -> None:
    make(grbl)
    assert notice(grbl) == f"Locked by ALARM:{alarm}: reset to continue"


def test_an_estop_that_is_pressed(grbl: Grbl) -> None:
    grbl.input("estop", True)
    grbl.send("")
    assert notice(grbl) == "Locked by ALARM:50: release the emergency stop"
    grbl.input("estop", False)
    grbl.send("")
    assert notice(grbl) == "Locked by ALARM:50: reset to continue"


@pytest.mark.parametrize(
    ("lock", "why"),
    [
        ("UPDATE", "A firmware update is being written: wait until it ends"),
        ("SAFE_MODE", "Safe mode after crashes in a row: switch the controller off and on"),
        ("STEPS_LOST", "Step pulses were lost: restart the controller"),
    ],
)
def test_a_controller_that_keeps_the_machine_stopped(grbl: Grbl, lock: str, why: str) -> None:
    """It stops as by the e-stop, but there is none to release."""
    LIB.virtual_lock(grbl._host, HOST.enum("hal_lock")[f"HAL_LOCK_{lock}"])
    assert grbl.send("") == f"ALARM:57\r\n[MSG:{why}]\r\n"
    assert notice(grbl) == f"Locked by ALARM:57: {why[0].lower()}{why[1:]}"
    assert "ALARM:57" in grbl.send("\x18")  # neither a reset nor an unlock leads out
    assert "ok" not in grbl.send("$X\n")
    LIB.virtual_lock(grbl._host, 0)
    assert "[MSG:Reset to continue]" in grbl.after(1)
    assert notice(grbl) == "Locked by ALARM:57: reset to continue"
    assert "Grbl 1.1h" in grbl.send("\x18") and "error" not in grbl.send("$X\nG0X1\n")


def test_an_alarm_that_unlocks(grbl: Grbl) -> None:
    grbl.send("G38.2Z-1F600\n")
    assert notice(grbl) == f"Locked by ALARM:5: {WAY_OUT}"
    grbl.send("$X\n")
    assert notice(grbl) is None


def test_homing_is_required_after_a_reset(grbl: Grbl) -> None:
    grbl.fine("$22=1")
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.send("\x18")
    assert notice(grbl) == f"Locked by ALARM:3: {WAY_OUT}"
    grbl.send("\x18")
    assert notice(grbl) == f"Locked since start or reset: {WAY_OUT}"


def test_a_limit_switch_that_is_closed_at_the_reset(grbl: Grbl) -> None:
    grbl.fine("$21=1")
    grbl.input("limit-x", True)
    grbl.send("\x18")
    assert notice(grbl) == "Locked by ALARM:1: reset to continue"
    grbl.send("\x18")
    assert notice(grbl) == f"Locked, check limits: {WAY_OUT}"


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
    assert notice(grbl) is None
