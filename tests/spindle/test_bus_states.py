"""A spindle's drive in every state: what switches the spindle off commands a stop, and a lost bus ends in an alarm."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from bus_grbl import BusGrbl, make_grbl
from drives import Drive, make_drive

ALARM = "ALARM:53"
STOP_S = 0.15  # a command of 9600 baud, behind one that is under way
QUIET_S = 0.6
MOVE = "G91\nG1X200F1200\n"


@pytest.fixture
def drive() -> Drive:
    return make_drive(5)[0]


@pytest.fixture
def grbl(drive: Drive) -> Iterator[BusGrbl]:
    controller = make_grbl(drive, "$395=5")
    controller.after(0.5, "M3S10000\n")
    yield controller
    controller.close()


# --- what switches the spindle off ---


@pytest.mark.parametrize("data", ["\x18", "M5\n", "M2\n", "M30\n", "$SLP\n", "M3S0\n", "S0\n"])
def test_a_stop_is_commanded_and_confirmed(grbl: BusGrbl, drive: Drive, data: str) -> None:
    grbl.after(STOP_S, data)
    assert drive.direction == 0
    grbl.after(1.0)
    assert drive.direction == 0


def test_estop(grbl: BusGrbl, drive: Drive) -> None:
    """Also in the quiet time after the alarm."""
    grbl.after(0.5, MOVE)
    grbl.input("estop", True)
    assert "ALARM:50" in grbl.after(STOP_S)
    assert drive.direction == 0
    grbl.input("estop", False)
    grbl.after(QUIET_S)


def test_door(grbl: BusGrbl, drive: Drive) -> None:
    """Off when motion rests, on again when it is closed and resumed, and motion after that."""
    grbl.after(0.5, MOVE)
    grbl.input("door", True)
    grbl.after(0.5)
    assert drive.direction == 0 and grbl.state() == "Door:1"
    grbl.input("door", False)
    grbl.after(1.0)
    assert drive.direction == 0
    drive.delay_s = 0.04
    before = grbl.position()
    grbl.put("~")
    while grbl.position() == before:
        grbl.after(0.005)
    assert drive.direction == 1


def test_spindle_stop_in_a_hold(grbl: BusGrbl, drive: Drive) -> None:
    """0x9E; `~` starts it again before motion."""
    grbl.after(0.5, MOVE)
    grbl.after(0.5, "!")
    assert drive.direction == 1
    grbl.after(STOP_S, "\x9e")
    assert drive.direction == 0
    before = grbl.position()
    drive.delay_s = 0.04
    grbl.put("~")
    while grbl.position() == before:
        grbl.after(0.005)
    assert drive.direction == 1


def test_sender_lost(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(0.5, MOVE)
    grbl.lose_sender()
    grbl.after(8.0)  # $75
    assert drive.direction == 0 and grbl.state() == "Hold:0"
    grbl.after(5.0)
    assert drive.direction == 0


def test_a_limit_switch(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(STOP_S, "M5\n")
    grbl.fine_soon("$21=1")
    grbl.after(0.5, "M3S5000\n" + MOVE)
    grbl.input("limit-x", True)
    assert "ALARM:1" in grbl.after(STOP_S)
    assert drive.direction == 0
    grbl.input("limit-x", False)
    grbl.after(QUIET_S)


def test_reversal(grbl: BusGrbl, drive: Drive) -> None:
    """$539 as with any spindle."""
    grbl.after(STOP_S, "M5\n")
    grbl.fine_soon("$539=1")
    grbl.after(1.5, "M3S5000\n")
    assert drive.direction == 1
    grbl.after(0.8, "M4\n")
    assert drive.direction == 0
    grbl.after(0.5)
    assert drive.direction == -1


# --- a bus that is lost, in every state ---


def in_hold(grbl: BusGrbl) -> None:
    grbl.after(0.5, MOVE)
    grbl.after(1.0, "!")
    assert grbl.state() == "Hold:0"


def in_m0(grbl: BusGrbl) -> None:
    grbl.after(0.5, "M0\n")
    assert grbl.state() == "Hold:0"


def in_jog(grbl: BusGrbl) -> None:
    grbl.after(0.5, "$J=G91X200F1200\n")
    assert grbl.state() == "Jog"


def in_idle(grbl: BusGrbl) -> None:
    assert grbl.state() == "Idle"


def in_dwell(grbl: BusGrbl) -> None:
    grbl.after(0.5, "G4P60\n")
    assert grbl.state() == "Run"


def in_park(grbl: BusGrbl) -> None:
    grbl.after(0.5, MOVE)
    grbl.after(1.0, "!")
    grbl.after(0.3, "\xa3")
    grbl.after(0.3, "$J=G91Z5F100\n")
    assert grbl.state().startswith("Hold")


def in_probe(grbl: BusGrbl) -> None:
    grbl.after(0.5, "G91G38.3Z-50F60\n")
    assert grbl.state() == "Run"


def in_arc(grbl: BusGrbl) -> None:
    grbl.after(0.5, "G91G2X0Y0I50F1200\n")
    assert grbl.state() == "Run"


def in_drilling(grbl: BusGrbl) -> None:
    grbl.after(0.5, "G91G81X5Z-5R1F60L9\n")
    assert grbl.state() == "Run"


TURNING = (in_hold, in_m0, in_jog, in_idle, in_dwell, in_park, in_probe, in_arc, in_drilling)


@pytest.mark.parametrize("enter", TURNING)
def test_lost_with_the_spindle_on(grbl: BusGrbl, drive: Drive, enter: Callable[[BusGrbl], None]) -> None:
    enter(grbl)
    drive.silent = True
    said, took = grbl.until(ALARM, 3.0)
    assert said.count("[MSG:Spindle drive") == 1 and took < 1.5
    position = grbl.position()
    grbl.after(QUIET_S)
    drive.silent = False
    assert grbl.state() == "Alarm"
    grbl.after(3.0, "~")
    assert grbl.position() == position == grbl.stands() and drive.direction == 0


def tool_change(grbl: BusGrbl) -> str:
    return grbl.after(1.0, "T1M6\n")


def door(grbl: BusGrbl) -> str:
    grbl.after(0.5, MOVE)
    grbl.input("door", True)
    return grbl.after(1.0)


def off(grbl: BusGrbl) -> str:
    return grbl.after(0.3, "M5\n")


def sleep(grbl: BusGrbl) -> str:
    return grbl.after(0.3, "$SLP\n")


@pytest.mark.parametrize("enter", [tool_change, door, off, sleep])
def test_lost_with_the_spindle_off(grbl: BusGrbl, drive: Drive, enter: Callable[[BusGrbl], str]) -> None:
    """A message, and no alarm: it has confirmed its stop. The next start finds out."""
    enter(grbl)
    state = grbl.state()
    drive.silent = True
    said = grbl.after(5.0)
    assert "ALARM" not in said and said.count("[MSG:Spindle drive") == 1
    assert grbl.state() == state
    drive.silent = False
    assert "answers again" in grbl.after(1.0)
    if enter is door:
        grbl.input("door", False)


def test_a_tool_change_does_not_resume_without_the_drive(grbl: BusGrbl, drive: Drive) -> None:
    tool_change(grbl)
    drive.silent = True
    grbl.after(2.0)
    before = grbl.position()
    said = grbl.after(0.1, "~")
    said += grbl.after(2.0, "M3S10000\nG91G1X5F600\n")
    assert ALARM in said
    assert grbl.position() == before


def test_a_closed_door_does_not_resume_without_the_drive(grbl: BusGrbl, drive: Drive) -> None:
    door(grbl)
    drive.silent = True
    grbl.input("door", False)
    grbl.after(1.0)
    before = grbl.position()
    assert ALARM in grbl.after(2.0, "~")
    assert grbl.position() == before


def test_lost_while_it_stops(grbl: BusGrbl, drive: Drive) -> None:
    """M5 is not confirmed: the spindle may turn on."""
    drive.silent = True
    said = grbl.after(2.0, "M5\n")
    assert ALARM in said and "ok" not in said.split(ALARM)[0]
    drive.silent = False
    grbl.after(1.0)
    assert drive.direction == 0


def test_lost_in_an_alarm(grbl: BusGrbl, drive: Drive) -> None:
    """The alarm that was first stays; the drive is commanded to stop until it hears that."""
    drive.silent = True
    grbl.input("estop", True)
    said = grbl.after(3.0)
    assert said.count("ALARM") == 1 and said.count("[MSG:Spindle drive") == 1
    drive.silent = False
    assert "answers again" in grbl.after(1.0)
    assert drive.direction == 0
    grbl.input("estop", False)


def test_a_reset_with_a_dead_drive_ends_in_the_alarm(grbl: BusGrbl, drive: Drive) -> None:
    drive.silent = True
    said = grbl.after(2.0, "\x18")
    assert ALARM in said
    drive.silent = False
    grbl.after(1.0)
    assert drive.direction == 0


def test_homing(drive: Drive) -> None:
    grbl = make_grbl(drive, "$395=5", "$22=1", "$25=600")
    for axis in range(3):
        grbl.travel(axis, -40000, 20000)
    grbl.after(0.1, "$X\n")
    grbl.after(0.5, "M3S5000\n")
    grbl.after(0.5, "$H\n")
    assert grbl.position() != [0] * 6  # it homes; as Grbl it reports no state meanwhile
    drive.silent = True
    said, _ = grbl.until("ALARM", 3.0)
    assert ALARM in said
    grbl.close()


def test_check_mode(grbl: BusGrbl, drive: Drive) -> None:
    """Nothing is commanded."""
    grbl.after(STOP_S, "M5\n")
    grbl.after(0.1, "$C\n")
    drive.log.clear()
    grbl.after(0.3, "M3S8000\nG1X1F100\n")
    assert drive.commands() == [] and drive.direction == 0
    grbl.after(0.3, "$C\n")
