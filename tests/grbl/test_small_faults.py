"""Faults that once could be made without a test noticing; each test here fails with one of them."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


@pytest.mark.parametrize("line", ["G28X50", "G30Y1", "G81X-1Z-5R50F100"])
def test_a_soft_limit_at_a_via_point(grbl: Grbl, line: str) -> None:
    """The end of the line lies within the travel, the point before it does not: nothing moves."""
    grbl.fine("$22=1", "$20=1", "G0X-5Y-5Z-5", "G28.1", "G30.1")
    at = grbl.stands()
    assert "ALARM:2\r\n" in grbl.send(line + "\n")
    assert grbl.stands() == at == grbl.position()


def test_a_reset_ends_the_timer_of_what_it_ends(grbl: Grbl) -> None:
    """In the middle of a spindle's run-up after the door: nothing is waited for any more."""
    grbl.fine("M3S500")
    grbl.after(0.1, "\x84")
    grbl.after(1, "~")
    assert grbl.state() == "Door:3" and not grbl.sleeps()
    grbl.after(0.1, "\x18")
    assert grbl.state() == "Idle" and grbl.sleeps()


def test_overrides_are_not_taken_in_sleep(grbl: Grbl) -> None:
    """Nothing but a reset acts in Sleep."""
    grbl.send("$SLP\n")
    grbl.send("\x91\x96\x9a\x9e\xa0")
    said = "".join(grbl.status() for _ in range(12))
    assert "Ov:100,100,100>" in said and "Ov:1" in said and "Ov:110" not in said
