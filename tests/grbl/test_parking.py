"""Parking ($42): at the door, and by choice in a feed hold, Z goes up before spindle and coolant stop."""

from __future__ import annotations

import pytest
from grbl_host import Grbl
from test_parked import PARK, PARKED, QUICK, STEPS
from test_switches import make_homing


def started(grbl: Grbl, mode: int, job: str, seconds: float = 0.6) -> None:
    """A job under way at machine Z-20 and work Z0."""
    make_homing(grbl)
    grbl.settings(s58=5, s59=600, s57=300, s394=2, s42=mode)
    grbl.fine(*QUICK, "$H", "G53G0X-20Y-20Z-20", "G10L20P1X0Y0Z0")
    grbl.after(seconds, job)


def stop(grbl: Grbl, how: str) -> str:
    """By a feed hold, or as the door does."""
    return grbl.after(0.5, "!" if how == "hold" else "\x84")


@pytest.mark.parametrize("how", ["door", "hold"])
def test_z_goes_up_before_the_spindle_stops_and_down_after_it_runs(grbl: Grbl, how: str) -> None:
    started(grbl, 2, "M3S1000M8\nG1X10F600\n", 2.8)
    stop(grbl, how)
    left = grbl.position()
    assert -20 * STEPS < left[0] < -10 * STEPS and left[2] > -20 * STEPS, "on its way up"
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2
    while grbl.position()[2] < -5 * STEPS:
        assert grbl.outputs().spindle_direction == 1
        grbl.after(0.01)
    grbl.after(0.05)
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    assert grbl.state() == ("Door:0" if how == "door" else "Hold:0")
    began = grbl.time()
    grbl.after(0.02, "~")
    while grbl.position()[2] == -5 * STEPS:
        grbl.after(0.01)
    assert grbl.time() - began >= 2 and grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2
    assert grbl.position()[:2] == left[:2]
    down = grbl.time()
    while grbl.position()[0] == left[0]:
        grbl.after(0.01)
    assert grbl.position()[2] == -20 * STEPS
    assert grbl.time() - down == pytest.approx(15 / 300 * 60, abs=0.3)
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[:3] == [-10 * STEPS, -20 * STEPS, -20 * STEPS]


def test_off_by_default_and_mode_1_is_the_doors(grbl: Grbl) -> None:
    for mode, how in ((0, "door"), (0, "hold"), (1, "hold")):
        started(grbl, mode, "M3S1000\nG1X10F600\n", 2.8)
        stop(grbl, how)
        grbl.after(3)
        assert grbl.position()[2] == -20 * STEPS
        grbl.after(8, "~")
        grbl.send("M5\n")


def test_an_idle_machine_parks_and_comes_back(grbl: Grbl) -> None:
    started(grbl, 1, "")
    stop(grbl, "door")
    grbl.after(4)
    assert grbl.position()[2] == -5 * STEPS
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[2] == -20 * STEPS
    assert grbl.send("G0X1\n") == "ok\r\n" and grbl.position()[0] == -19 * STEPS


@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.0, 4.0])
def test_the_door_opens_again_on_the_way_back(grbl: Grbl, seconds: float) -> None:
    started(grbl, 1, "M3S1000\nG1X10F600\n", 2.8)
    grbl.input("door", True)
    grbl.after(3)
    for _ in range(3):
        grbl.input("door", False)
        grbl.after(seconds, "~")
        grbl.input("door", True)
        grbl.after(3)
        assert grbl.position()[2] == -5 * STEPS and grbl.outputs().spindle_direction == 0
    grbl.input("door", False)
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[:3] == [-10 * STEPS, -20 * STEPS, -20 * STEPS]


def test_what_does_not_park(grbl: Grbl) -> None:
    """M0 stays where it is; a probing move cannot be left; an axis that is not homed has no height."""
    started(grbl, 2, "M0\n")
    grbl.after(2)
    assert grbl.position()[2] == -20 * STEPS
    grbl.after(0.2, "~")
    grbl.after(0.3, "G38.3Z-5F100\n")
    grbl.after(3, "!")
    assert grbl.position()[2] < -20 * STEPS
    grbl.send("~")
    grbl.fine("$42=1")
    grbl.after(0.1, "G91G1X5F600\n")
    grbl.send("\x18")
    grbl.send("$X\n")
    at = grbl.position()
    assert stop(grbl, "door") == "[MSG:Check Door]\r\n[MSG:Not parked: Z is not homed]\r\n"
    assert grbl.after(3) == "" and grbl.position() == at


def test_the_operator_takes_it_from_there(grbl: Grbl) -> None:
    """0xA3 in a hold that has parked: jog, zero; ~ returns to the place of the job."""
    started(grbl, 2, "M3S1000\nG1X10F600\n", 2.8)
    stop(grbl, "hold")
    grbl.after(4)
    left = grbl.position()
    assert grbl.after(2, PARK + "$J=G91X5F2000\n") == PARKED + "ok\r\n"
    assert grbl.position()[0] == left[0] + 5 * STEPS and grbl.outputs().spindle_direction == 0
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[:3] == [-10 * STEPS, -20 * STEPS, -20 * STEPS]
    assert grbl.outputs().spindle_direction == 1


@pytest.mark.parametrize("seconds", [0.2, 1.0, 3.0])
def test_a_reset_ends_it(grbl: Grbl, seconds: float) -> None:
    started(grbl, 1, "M3S1000\nG1X10F600\n", 2.8)
    stop(grbl, "door")
    grbl.after(seconds)
    assert "Grbl 1.1h" in grbl.after(2, "\x18")
    grbl.after(1, "$X\n")
    at = grbl.position()
    assert grbl.after(3, "~") == "" and grbl.position() == at and grbl.outputs().spindle_direction == 0
    assert grbl.send("G91G1X1F600\n") == "ok\r\n" and grbl.position()[0] == at[0] + STEPS


def test_behind_an_open_door_it_waits(grbl: Grbl) -> None:
    """The door's own line: Z goes up while it is open, and nothing comes down before it is closed."""
    started(grbl, 1, "M3S1000\nG1X10F600\n", 2.8)
    grbl.input("door", True)
    grbl.after(4, "~")
    assert grbl.state() == "Door:1" and grbl.position()[2] == -5 * STEPS
    assert grbl.after(5, "~") == "" and grbl.position()[2] == -5 * STEPS and grbl.outputs().spindle_direction == 0
    grbl.input("door", False)
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[:3] == [-10 * STEPS, -20 * STEPS, -20 * STEPS]
