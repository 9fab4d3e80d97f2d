"""Fault outputs of motor drivers and servos at digital inputs: $744 says which, $745 which of them are low then."""

from __future__ import annotations

import re

from grbl_host import BANNER, LOCKED, Grbl

RESET = "[MSG:Reset to continue]\r\n"
FAULT = "ALARM:54\r\n" + RESET
CHECK = "[MSG:Check motor drivers: P0]\r\n"
STEPS_MM = 250
SHORT_S, LONG_S = 0.0015, 0.02  # less than 2 ms is noise; a chip waits for 5 ms of quiet before


def watched(grbl: Grbl) -> Grbl:
    grbl.fine("$744=1")
    return grbl


def test_motion_stops_in_a_job(grbl: Grbl) -> None:
    """The counter is the pulses that left the pins; what the motor has made of them is not known."""
    watched(grbl).fine("M3S100M8")
    grbl.after(0.2, "G1X20F1000\nX0\n")
    grbl.input_in(0.01, "input-0", True)
    said = grbl.after(0.01 + LONG_S)
    at = grbl.stands()
    said += grbl.send("")
    assert said.replace("error:9\r\n", "").replace("ok\r\n", "") == FAULT
    assert 0 < at[0] < 20 * STEPS_MM and grbl.stands() == at == grbl.position()
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0


def test_at_rest_too(grbl: Grbl) -> None:
    watched(grbl)
    grbl.input("input-0", True)
    assert grbl.send("") == FAULT, "the 2 ms end by themselves: no line, byte or switch comes"
    assert "Pn:M" in grbl.status()


def test_noise_is_no_fault(grbl: Grbl) -> None:
    watched(grbl)
    grbl.after(0.2, "G1X20F1000\n")
    for begin in range(1, 40, 4):
        grbl.input_in(1e-3 * begin, "input-0", True)
        grbl.input_in(1e-3 * begin + SHORT_S, "input-0", False)
    grbl.after(0.1)
    assert grbl.status().startswith("<Run")
    assert grbl.send("") == "" and grbl.stands()[0] == 20 * STEPS_MM


def test_the_way_out_is_shut_while_it_lasts(grbl: Grbl) -> None:
    """A reset is allowed and locks; neither $X nor $H moves a motor that has a fault."""
    grbl.fine("$22=1")
    watched(grbl)
    grbl.input("input-0", True)
    grbl.after(LONG_S)
    grbl.send("")
    assert grbl.send("\x18") == BANNER + CHECK + LOCKED
    for line in ("$X", "$H"):
        assert grbl.send(f"{line}\n") == "error:194\r\n", line
    assert grbl.state() == "Alarm"
    grbl.input("input-0", False)
    grbl.after(LONG_S)
    assert grbl.send("$X\n").endswith("ok\r\n") and grbl.state() == "Idle"


def test_a_wrong_polarity_can_be_mended(grbl: Grbl) -> None:
    """The setting that locks is changed in the lock."""
    grbl.fine("$745=1")
    said = grbl.send("$744=1\n") + grbl.after(LONG_S) + grbl.send("")
    assert FAULT in said and said.replace(FAULT, "") == "ok\r\n"
    grbl.send("\x18")
    grbl.fine("$745=0")
    grbl.after(LONG_S)
    assert grbl.send("$X\n").endswith("ok\r\n") and grbl.state() == "Idle"


def test_an_output_that_is_low_in_a_fault(grbl: Grbl) -> None:
    """A broken cable is a fault, too."""
    grbl.input("input-1", True)
    grbl.after(LONG_S)
    grbl.fine("$745=2", "$744=2")
    assert grbl.after(LONG_S) == "" and grbl.state() == "Idle"
    grbl.input("input-1", False)
    assert grbl.after(LONG_S) + grbl.send("") == FAULT
    assert grbl.send("\x18") == BANNER + CHECK.replace("P0", "P1") + LOCKED


def test_asleep_it_is_told_after_the_reset(grbl: Grbl) -> None:
    """Drivers without current may report anything, and nothing moves."""
    watched(grbl).send("$SLP\n")
    grbl.input("input-0", True)
    assert grbl.after(LONG_S) + grbl.send("") == "" and grbl.state() == "Sleep"
    assert grbl.send("\x18") == BANNER + CHECK + LOCKED


def test_where_the_axes_are_is_not_known_after_it(grbl: Grbl) -> None:
    """Not even at rest: a servo without power was turned by hand."""
    grbl.fine("$22=1", "$23=0", "$27=1")
    for axis in range(3):
        grbl.travel(axis, -100_000, 100)
    assert grbl.send("$H\n").endswith("ok\r\n")
    watched(grbl)
    grbl.input("input-0", True)
    grbl.after(LONG_S)
    grbl.send("")
    grbl.input("input-0", False)
    grbl.after(LONG_S)
    grbl.send("\x18")
    said = grbl.send("$X\n")
    assert re.search(r"\[MSG:Not homed: XYZ[ABC]*\]", said), said
