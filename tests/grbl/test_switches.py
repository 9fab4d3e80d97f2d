"""Switches, probe, door and e-stop of the virtual machine: checklist 4.4, 4.5b, and design invariants 1, 2 and 7."""

from __future__ import annotations

import pytest
from grbl_host import BANNER, LOCKED, Grbl

RESET = "[MSG:Reset to continue]\r\n"
RELEASE = "[MSG:Release the emergency stop]\r\n"


def steps(*mm: float) -> list[int]:
    return [round(250 * value) for value in mm]


# --- probing ---


@pytest.mark.parametrize("surface", [-1, -17, -1234, -2499])
@pytest.mark.parametrize("feed", [30, 300, 3000])
def test_the_exact_trigger_position(grbl: Grbl, surface: int, feed: int) -> None:
    """`[PRB:x,y,z:0|1]`: the step at which the probe changed, whatever the feed; the machine rests a little below."""
    grbl.surface(surface)
    assert grbl.send(f"G38.2Z-10F{feed}\n") == f"[PRB:0.000,0.000,{surface / 250:.3f}:1]\r\nok\r\n"
    assert grbl.position() == grbl.stands() and -2500 <= grbl.position()[2] <= surface
    assert grbl.send("G0Z1\n") == "ok\r\n" and grbl.stands()[2] == 250
    assert f"[PRB:0.000,0.000,{surface / 250:.3f}:1]" in grbl.send("$#\n")


def test_probing_away(grbl: Grbl) -> None:
    """G38.4 stops where contact ends: one step above the surface."""
    grbl.surface(-1000)
    grbl.send("G38.2Z-10F600\n")
    assert grbl.send("G38.4Z10F600\n") == "[PRB:0.000,0.000,-3.996:1]\r\nok\r\n"


def test_an_inverted_probe(grbl: Grbl) -> None:
    """$6=1: the line is high on contact. Here it is low on contact, so contact is lost below the surface."""
    grbl.surface(-1000)
    grbl.fine("$6=1")
    assert "Pn:P" in grbl.status()
    assert grbl.send("G38.4Z-10F600\n") == "[PRB:0.000,0.000,-4.000:1]\r\nok\r\n"


def test_contact_at_the_very_end(grbl: Grbl) -> None:
    """The last step of the move closes the probe: no later step could see it, and still it counts."""
    grbl.surface(-2500)
    assert grbl.send("G38.2Z-10F600\n") == "[PRB:0.000,0.000,-10.000:1]\r\nok\r\n"


@pytest.mark.parametrize("code", ["G38.2", "G38.3"])
def test_alarm_4(grbl: Grbl, code: str) -> None:
    """Alarm 4 probe initial state."""
    grbl.input("probe", True)
    assert grbl.send(f"{code}Z-1F100\n").startswith("ALARM:4\r\n") and grbl.state() == "Alarm"
    assert grbl.position()[2] == 0
    assert grbl.send("$X\n") == "[MSG:Caution: Unlocked]\r\nok\r\n"


@pytest.mark.parametrize(("code", "alarm"), [("G38.2", True), ("G38.3", False)])
def test_alarm_5(grbl: Grbl, code: str, alarm: bool) -> None:
    """Alarm 5 probe no contact; G38.3 may miss."""
    said = grbl.send(f"{code}Z-1F100\n")
    assert ("ALARM:5" in said) == alarm and said.endswith(":0]\r\nok\r\n")
    assert grbl.position()[2] == -250 and (grbl.state() == "Alarm") == alarm


def test_a_failed_probe_is_still_the_motion_mode(grbl: Grbl) -> None:
    """After alarm 5 and `$X` Grbl's modal motion is G38.2, as after a probe that touched; only a reset ends it."""
    grbl.send("G38.2Z-1F100\n")
    grbl.send("$X\n")
    assert "[GC:G38.2 " in grbl.send("$G\n")
    grbl.send("\x18")
    assert "[GC:G0 " in grbl.send("$G\n")


def test_hold_while_probing(grbl: Grbl) -> None:
    """Feed hold during everything: a probe move stops and continues, and its trigger stays exact."""
    grbl.surface(-2000)
    grbl.after(0.3, "G38.2Z-20F600\n")
    grbl.after(1, "!")
    assert grbl.state() == "Hold:0"
    assert grbl.send("~") == "[PRB:0.000,0.000,-8.000:1]\r\nok\r\n"


def test_reset_while_probing(grbl: Grbl) -> None:
    """3 reset in motion, while a line is executing: ALARM:3, its `ok`, banner; the next probe works."""
    grbl.surface(-2000)
    grbl.after(0.3, "G38.2Z-20F600\n")
    assert grbl.send("\x18") == "ALARM:3\r\nok\r\n" + BANNER + LOCKED
    grbl.send("$X\n")
    assert grbl.send("G38.2Z-20F600\n") == "[PRB:0.000,0.000,-8.000:1]\r\nok\r\n"


# --- limits and e-stop ---


def test_hard_limit_stops_at_once(grbl: Grbl) -> None:
    """Alarm 1 hard limit: not one step after the switch closed; only 0x18 works."""
    grbl.travel(0, -5000, 1000)
    grbl.fine("$21=1")
    assert grbl.send("G1X20F3000\nG0X0\n") == "ok\r\nok\r\nALARM:1\r\n" + RESET
    assert grbl.stands()[0] == grbl.position()[0] == 1000
    assert grbl.send("$X\nG0X1\n") == "error:9\r\n" * 2 and grbl.state() == "Alarm"
    assert grbl.send("\x18") == BANNER + "[MSG:Check Limits]\r\n" + LOCKED
    grbl.send("$X\n")
    assert grbl.send("G0X0\n") == "ok\r\n" and grbl.stands()[0] == 0


def test_limits_without_21_do_nothing(grbl: Grbl) -> None:
    """Hard limits off: switches are only shown."""
    grbl.travel(0, -5000, 1000)
    assert grbl.send("G1X8F3000\n") == "ok\r\n" and grbl.stands()[0] == 2000 and "Pn:X" in grbl.status()


@pytest.mark.parametrize("delay", [0.0004, 0.05, 0.123, 0.31])
def test_estop(grbl: Grbl, delay: float) -> None:
    """Alarm 10 means two things in the wild: use a new number for E-stop; no step leaves the pins after it, the
    position survives."""
    grbl.fine("M3S100M8")
    grbl.after(0.02, "G1X-20Y-13F3000\nX0\n")
    grbl.input_in(delay, "estop", True)
    said = grbl.after(delay + 1 / 20e6)
    at = grbl.stands()
    said += grbl.send("")
    assert said.replace("error:9\r\n", "") == "ALARM:50\r\n" + RELEASE and grbl.stands() == at == grbl.position()
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    assert grbl.send("\x18") == BANNER + LOCKED + "ALARM:50\r\n" + RELEASE  # still pressed
    grbl.input("estop", False)
    assert grbl.send("") == RESET
    assert grbl.send("\x18") == BANNER + LOCKED
    grbl.send("$X\n")
    assert grbl.send("G0X0Y0\n") == "ok\r\n" and grbl.stands() == [0] * 6


@pytest.mark.parametrize(("name", "alarm"), [("estop", 50), ("limit-max-y", 1)])
def test_a_short_pulse_is_not_missed(grbl: Grbl, name: str, alarm: int) -> None:
    """Invariant 7: the edge counts, even when the switch is open again before anyone looks."""
    grbl.fine("$21=1", "$92=0")
    grbl.after(0.2, "G1X-20F1000\n")
    grbl.input(name, True)
    grbl.input(name, False)
    at = grbl.stands()
    assert grbl.send("") == f"ALARM:{alarm}\r\n" + RESET and grbl.stands() == at == grbl.position()
    assert grbl.send("\x18") == BANNER + LOCKED
    grbl.send("$X\n")
    assert grbl.send("G0X0\n") == "ok\r\n" and grbl.stands()[0] == 0


# --- door and buttons ---


def test_door_with_resume(grbl: Grbl) -> None:
    """Door:2 slows down, Door:1 open, Door:0 closed, Door:3 restoring; then the job continues where it was."""
    grbl.fine("M3S500M8")
    grbl.after(0.2, "G1X-20F3000\n")
    grbl.input("door", True)
    assert grbl.after(0.001) == "[MSG:Check Door]\r\n" and grbl.state() == "Door:2"
    grbl.after(1)
    assert grbl.state() == "Door:1" and grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    grbl.after(1, "~")
    assert grbl.state() == "Door:1"
    grbl.input("door", False)
    assert grbl.state() == "Door:0"
    grbl.after(1, "~")
    assert grbl.state() == "Door:3" and grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 0
    assert -5000 < grbl.position()[0] < 0
    grbl.send("")
    assert grbl.outputs().coolant == 2 and grbl.stands()[0] == -5000 and grbl.state() == "Idle"


def test_door_opens_again_while_restoring(grbl: Grbl) -> None:
    """Door:3 with an open door is Door:1 again, outputs off."""
    grbl.fine("M3S500")
    grbl.input("door", True)
    grbl.after(0.1)
    grbl.input("door", False)
    grbl.after(1, "~")
    grbl.input("door", True)
    grbl.after(0.001)
    assert grbl.state() == "Door:1" and grbl.outputs().spindle_direction == 0
    grbl.after(10)
    assert grbl.state() == "Door:1"


def test_door_in_a_jog(grbl: Grbl) -> None:
    """A door that opens in a jog cancels it."""
    grbl.after(0.3, "$J=X-20F1000\n")
    grbl.input("door", True)
    grbl.after(1)
    at = grbl.stands()
    grbl.input("door", False)
    grbl.send("~")
    assert grbl.state() == "Idle" and grbl.stands() == at == grbl.position()
    assert grbl.send("G0X0\n") == "ok\r\n" and grbl.stands()[0] == 0


def test_unlocking_with_an_open_door(grbl: Grbl) -> None:
    """`$X` and `$H` with an open door: error:13."""
    grbl.send("$SLP\n")
    grbl.send("\x18")
    grbl.input("door", True)
    assert grbl.send("$X\n") == "error:13\r\n"


def test_buttons(grbl: Grbl) -> None:
    """Hold, start and reset buttons act as `!`, `~` and 0x18, once a press."""
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.input("hold", True)
    grbl.after(1)
    assert grbl.state() == "Hold:0"
    grbl.input_in(0.5, "start", True)
    grbl.send("")
    assert grbl.position()[0] == -5000
    grbl.input("reset", True)
    assert grbl.send("") == BANNER


# --- homing ---


def make_homing(grbl: Grbl, dir_mask: int = 0) -> None:
    for axis in range(3):
        grbl.travel(axis, -10000 - 3 * axis, 1000 + 7 * axis)
    grbl.settings(s22=1, s23=dir_mask, s24=100, s25=2000, s26=25, s27=2, s130=40, s131=41, s132=42)


@pytest.mark.parametrize("mask", [0, 1, 4, 7])
@pytest.mark.parametrize("start", [(0, 0, 0), (-9000, 900, 3), (1000, 1007, 1014), (-10000, -10003, -10006)])
def test_homing_finds_the_exact_switches(grbl: Grbl, mask: int, start: tuple[int, int, int]) -> None:
    """$H: the machine is exactly a pull-off from the switches and knows it, from wherever it started."""
    make_homing(grbl, mask)
    grbl.place([*start, 0, 0, 0])
    assert grbl.send("$H\n") == "ok\r\n" and grbl.state() == "Idle"
    for axis in range(3):
        negative = mask >> axis & 1
        switch = -10000 - 3 * axis if negative else 1000 + 7 * axis
        assert grbl.stands()[axis] == switch + (500 if negative else -500)
        assert grbl.position()[axis] == ((-(40 + axis) * 250 + 500) if negative else -500)


def test_homing_unlocks_and_runs_startup_lines(grbl: Grbl) -> None:
    """Power-up with $22=1 = Alarm: `$H` unlocks; then the startup lines run, then its `ok`."""
    make_homing(grbl)
    grbl.fine("$N0=G20")
    grbl.send("$SLP\n")
    grbl.send("\x18")
    assert grbl.send("$H\n") == ">G20:ok\r\nok\r\n" and grbl.state() == "Idle"


def test_homing_one_axis(grbl: Grbl) -> None:
    """$HX: only that axis; the others keep their position."""
    make_homing(grbl)
    grbl.fine("G0Y1Z2")
    assert grbl.send("$HX\n") == "ok\r\n"
    assert grbl.position()[:3] == [-500, 250, 500] and grbl.stands()[:3] == [500, 250, 500]
    assert grbl.send("$HQ\n") == "error:3\r\n" and grbl.send("$HA\n") == "error:3\r\n"


@pytest.mark.parametrize(
    ("cycles", "command", "order"),
    [
        ({}, "$H", ["Z", "XY"]),
        ({"s44": 3, "s45": 4}, "$H", ["XY", "Z"]),
        ({"s44": 1, "s45": 2, "s46": 4}, "$H", ["X", "Y", "Z"]),
        ({"s44": 7, "s45": 7}, "$H", ["XYZ"]),
        ({"s44": 0, "s45": 0, "s49": 6}, "$H", ["YZ"]),
        ({"s44": 4, "s45": 0}, "$HXZ", ["Z", "X"]),
        ({"s44": 0, "s45": 0}, "$HXY", ["XY"]),
    ],
)
def test_order_of_homing(grbl: Grbl, cycles: dict[str, int], command: str, order: list[str]) -> None:
    """Homing cycles with configurable order and axes: $44 to $49 say which axes home together, and when."""
    make_homing(grbl)
    grbl.settings(**cycles)
    seen, last, before = [""], "", grbl.stands()
    said = grbl.after(0.0, command + "\n")
    while "ok" not in said:
        said += grbl.after(0.02)
        now = grbl.stands()
        moving = "".join(letter for letter, a, b in zip("XYZ", before, now, strict=False) if a != b)
        if moving == last and set(moving) - set(seen[-1]):  # twice, so that it is not the change from one to the next
            seen.append(moving)
        before, last = now, moving
    assert seen[1:] == order
    homed = "".join(order)
    assert [grbl.position()[ax] == -500 for ax in range(3)] == [letter in homed for letter in "XYZ"]


def test_no_axis_to_home(grbl: Grbl) -> None:
    """$22 on and no axis in a cycle: error:5, nothing hangs."""
    make_homing(grbl)
    grbl.settings(s44=0, s45=0)
    assert grbl.send("$H\n") == "error:5\r\n" and grbl.state() == "Idle"


def test_reports_are_silent_while_homing(grbl: Grbl) -> None:
    """Homing aborted by reset = `ALARM:6`. `?` silent meanwhile. 6 homing reset."""
    make_homing(grbl)
    assert grbl.after(0.3, "$H\n") == ""
    assert grbl.after(0.1, "?") == ""
    assert grbl.send("\x18") == "ALARM:6\r\nok\r\n" + BANNER + LOCKED
    assert grbl.position() == grbl.stands()


def test_a_full_report_is_answered_while_homing(grbl: Grbl) -> None:
    """0x87, so that a client can tell a busy controller from a dead link; a `?` still waits for the end."""
    make_homing(grbl)
    assert grbl.after(0.3, "$H\n") == ""
    said = grbl.after(0.1, "?\x87")
    assert said.count("<") == 1 and said.startswith("<Home|MPos:")


@pytest.mark.needs("door")
def test_alarm_7(grbl: Grbl) -> None:
    """Alarm 7 homing door."""
    make_homing(grbl)
    grbl.after(0.3, "$H\n")
    grbl.input("door", True)
    assert grbl.send("").startswith("ALARM:7\r\n") and grbl.position() == grbl.stands()


def test_alarm_8(grbl: Grbl) -> None:
    """Alarm 8 homing pull-off failed."""
    make_homing(grbl)
    grbl.input("limit-max-x", True)
    assert grbl.send("$HX\n") == "ALARM:8\r\nok\r\n" + BANNER + LOCKED


def test_alarm_9(grbl: Grbl) -> None:
    """Alarm 9 homing switch not found: bounded by 1.5 travels."""
    make_homing(grbl)
    grbl.travel(0, -100000, 100000)
    assert grbl.send("$HX\n") == "ALARM:9\r\nok\r\n" + BANNER + LOCKED
    assert grbl.stands()[0] == 40 * 1.5 * 250 == grbl.position()[0]


def test_estop_while_homing(grbl: Grbl) -> None:
    """E-stop in homing: no step after it."""
    make_homing(grbl)
    grbl.after(0.3, "$H\n")
    grbl.input("estop", True)
    at = grbl.stands()
    assert grbl.send("") == "ALARM:50\r\n" + RELEASE + "error:9\r\n" and grbl.stands() == at


def test_jog_beyond_travel(grbl: Grbl) -> None:
    """Error 15 jog beyond travel; without soft limits it is allowed."""
    grbl.fine("$22=1", "$20=1")
    assert grbl.send("$J=G91X1F1000\n") == "error:15\r\n" and grbl.state() == "Idle"
    grbl.fine("$20=0", "$J=G91X1F1000")
    assert grbl.position()[0] == 250


@pytest.fixture
def clamped(grbl: Grbl) -> Grbl:
    """10 mm below the end of X and Y, 40 by 30 mm of travel, and jogs that end at its ends."""
    grbl.fine("$22=1", "$130=40", "$131=30", "$20=1", "$56=1", "$J=G91X-10Y-10F5000", "G4P0")
    return grbl


@pytest.mark.parametrize(
    ("jog", "there_mm"),
    [
        ("G91X20Y-5F1000", (0, -12.5)),  # on the line, not along the wall
        ("G91X1000Y1000F1000", (0, 0)),
        ("G91X-40Y-40F1000", (-30, -30)),  # Y ends first
        ("G53X-100F1000", (-40, -10)),
        ("G91X5Y5F1000", (-5, -5)),
    ],
)
def test_a_jog_ends_where_the_travel_ends(clamped: Grbl, jog: str, there_mm: tuple[float, float]) -> None:
    clamped.fine(f"$J={jog}", "G4P0")
    assert clamped.position()[:2] == pytest.approx([250 * mm for mm in there_mm], abs=0.5)
    assert clamped.send("$J=G91X0.001F100\n") == "ok\r\n", "and nothing is trusted less"


def test_a_jog_into_the_wall_goes_nowhere(clamped: Grbl) -> None:
    clamped.fine("$J=G91X20F1000", "$J=G91X1F1000", "$J=G91X1Y-3F1000", "G4P0")
    assert clamped.position()[:2] == [0, -2500]
    clamped.fine("$J=G91Y-3F1000", "G4P0")
    assert clamped.position()[:2] == [0, -3250]


def test_a_jog_that_lies_outside_is_refused(clamped: Grbl) -> None:
    """Where soft limits were off before: a way that begins outside can only end inside."""
    clamped.fine("$20=0", "$J=G53X5F1000", "G4P0", "$20=1")
    assert clamped.send("$J=G91X-2F1000\n") == clamped.send("$J=G91X2F1000\n") == "error:15\r\n"
    clamped.fine("$J=G91X-6F1000", "G4P0")
    assert clamped.position()[0] == -250


def test_a_program_is_not_shortened(clamped: Grbl) -> None:
    assert "ALARM:2" in clamped.send("G1X20F1000\n")


def test_an_estop_before_the_first_step(grbl: Grbl) -> None:
    """The move that waited for look-ahead is gone, and no one wakes up for it for ever."""
    grbl.paced(0.002, "G1X5F100\n")
    assert not grbl.sleeps()
    grbl.input("estop", True)
    assert "ALARM:50" in grbl.paced(0.002)
    grbl.paced(1)
    assert grbl.sleeps() and grbl.position()[0] == 0
