"""$1 and $4: power of the motors. Virtual time."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


def power(grbl: Grbl) -> bool:
    return bool(grbl.outputs().motors)


def test_on_with_the_first_step_and_off_after_the_delay(grbl: Grbl) -> None:
    """$1: Step idle delay, ms. Power-on is off."""
    grbl.fine("$1=100")
    grbl.after(1)
    assert not power(grbl)
    grbl.after(0.01, "G1X1F6000\n")
    grbl.after(0.01)
    assert grbl.position()[0] > 0 and power(grbl)
    while grbl.state() != "Idle":
        grbl.after(0.001)
    grbl.after(0.09)
    assert power(grbl)
    grbl.after(0.02)
    assert not power(grbl)


def test_255_keeps_them_on(grbl: Grbl) -> None:
    """From the moment it is set, as in Grbl; and any other value switches off at last."""
    grbl.fine("$1=255")
    grbl.after(0.01)
    assert power(grbl)
    grbl.after(100)
    assert power(grbl)
    grbl.after(100, "\x18")
    assert power(grbl)
    grbl.fine("$1=254")
    grbl.after(1)
    assert not power(grbl)


def test_they_stay_on_between_moves(grbl: Grbl) -> None:
    grbl.fine("$1=25")
    grbl.put("G1X1F600\nG4P0.5\nG1X2\n")
    seen = []
    while grbl.state() != "Idle" or not seen:
        grbl.after(0.005)
        seen.append(power(grbl))
    assert all(seen)


@pytest.mark.parametrize("invert", [0, 1])
def test_level_of_the_enable_line(grbl: Grbl, invert: int) -> None:
    """$4: Step enable invert: 0 low enables, 1 high enables; also while it is at rest."""
    grbl.fine(f"$4={invert}")
    grbl.after(0.01)
    assert grbl.outputs().enable_high == (invert == 0)
    grbl.fine("$1=255")
    grbl.after(0.01)
    assert grbl.outputs().enable_high == (invert == 1)
    grbl.fine(f"$4={1 - invert}")
    grbl.after(0.01)
    assert grbl.outputs().enable_high == (invert == 0) and power(grbl)


def test_sleep_switches_them_off(grbl: Grbl) -> None:
    """$SLP: de-energizes spindle, coolant and stepper drivers."""
    grbl.fine("$1=255")
    grbl.after(0.01)
    assert power(grbl)
    grbl.after(0.1, "$SLP\n")
    assert not power(grbl)
    grbl.after(1, "\x18")
    assert power(grbl)


def test_homing_keeps_them_on(grbl: Grbl) -> None:
    """A pause for the switches is longer than $1: what was found must not be lost."""
    grbl.travel(0, -20 * 250, 20 * 250)
    grbl.fine("$1=25", "$22=1", "$26=250", "$25=2000", "$24=200", "$27=1")
    grbl.put("$HX\n")
    seen = []
    while "ok" not in (said := grbl.after(0.01)):
        assert "ALARM" not in said
        seen.append(power(grbl))
    assert len(seen) > 50 and all(seen[5:])


def test_no_step_before_they_are_awake() -> None:
    grbl = Grbl(motors_wake_us=5000)
    try:
        grbl.record()
        begin = grbl.time()
        grbl.send("G1X1F6000\n")
        assert grbl.first_step_s() - begin >= 0.005 and grbl.position()[0] == 250
    finally:
        grbl.close()
