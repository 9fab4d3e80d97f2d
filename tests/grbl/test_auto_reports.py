"""Automatic status reports of a machine with one connection, as the PIC32MZ has; those of a hub's clients:
tests/esp32/reports.c."""

from __future__ import annotations

import pytest
from grbl_host import BANNER, LOCKED, Grbl


def count(said: str) -> int:
    return sum(line.startswith("<") for line in said.split("\r\n"))


def test_they_come_at_their_interval(grbl: Grbl) -> None:
    """FluidNC's line: milliseconds, 0 is off."""
    assert grbl.send("$RI=100\n") == "ok\r\n"
    assert abs(count(grbl.after(1.05)) - 10) <= 1
    assert grbl.send("$RI=0\n").endswith("ok\r\n")
    assert count(grbl.after(1.0)) == 0


def test_they_come_in_motion_and_in_a_hold(grbl: Grbl) -> None:
    grbl.after(0.1, "$RI=50\nG1X-10F600\n")
    moving = grbl.after(0.5)
    assert abs(count(moving) - 10) <= 1 and "<Run|" in moving
    held = grbl.after(0.5, "!")
    assert abs(count(held) - 10) <= 1 and "<Hold:0|" in held
    grbl.after(0.1, "\x18")


def test_a_byte_turns_them_off_and_on(grbl: Grbl) -> None:
    """grblHAL's 0x8C. Where no interval was set it does nothing."""
    assert count(grbl.after(1.0, "\x8c")) == 0
    grbl.after(0.1, "$RI=50\n")
    assert count(grbl.after(1.0, "\x8c")) == 0
    assert abs(count(grbl.after(1.02, "\x8c")) - 20) <= 1


def test_a_byte_within_a_line_does_not_spoil_it(grbl: Grbl) -> None:
    assert "ok\r\n" in grbl.after(0.1, "G1X\x8c1F600\n") and "error" not in grbl.after(0.01, "\x8c")


@pytest.mark.parametrize(
    ("text", "error"),
    [("", 2), ("-1", 2), ("1e3", 2), ("200x", 2), ("49", 182), ("60001", 182), ("99999999999999", 182)],
)
def test_what_is_no_interval_is_refused(grbl: Grbl, text: str, error: int) -> None:
    assert grbl.send(f"$RI={text}\n") == f"error:{error}\r\n"
    assert count(grbl.after(1.0)) == 0


def test_a_reset_ends_them(grbl: Grbl) -> None:
    grbl.after(0.1, "$RI=50\n")
    assert grbl.after(0.2, "\x18").endswith(BANNER)
    assert count(grbl.after(1.0)) == 0


def test_they_wait_for_the_end_of_homing_and_are_one(grbl: Grbl) -> None:
    """As `?`: Grbl is silent while it homes."""
    grbl.fine("$22=1", "$25=100", "$24=100")
    grbl.after(0.1, "$RI=50\n$H\n")
    assert count(grbl.after(1.0)) == 0
    said = grbl.after(1.0, "\x18")
    assert said.endswith(LOCKED) and count(said) == 0


def test_a_locked_machine_sends_them(grbl: Grbl) -> None:
    grbl.fine("$22=1")
    grbl.send("\x18")
    grbl.after(0.1, "G1X9F100\n")
    assert grbl.after(1.0, "\x18").endswith(LOCKED)
    grbl.after(0.02, "$RI=50\n")
    said = grbl.after(0.5)
    assert abs(count(said) - 10) <= 1 and "<Alarm|" in said
