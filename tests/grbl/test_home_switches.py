"""Home switches of their own (`axis.x.home` of a board): homing looks for them, and limits stay limits."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from grbl_host import BANNER, Grbl

PULL_OFF = 500  # $27=2 at 250 steps/mm
LIMIT, HOME = (-10500, 1500), (-10003, 1007)  # true steps: the limits lie behind the home switches
LOST = "ALARM:1\r\n[MSG:Reset to continue]\r\nerror:9\r\n"


def made(home: int = 7, **board: int) -> Grbl:
    grbl = Grbl(home=home, **board)
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)})
    for axis in range(3):
        grbl.travel(axis, *LIMIT)
        grbl.homing(axis, *HOME)
    grbl.settings(s21=1, s22=1, s24=100, s25=2000, s26=25, s27=2, s130=100, s131=100, s132=100)
    return grbl


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    machine = made()
    yield machine
    machine.close()


@pytest.mark.parametrize("mask", [0, 2, 7])
def test_homing_ends_a_pull_off_before_the_home_switches(grbl: Grbl, mask: int) -> None:
    """`$23` says at which end they are; the travel ends where they are, not where the limits are."""
    grbl.settings(s23=mask)
    grbl.place([-4000, -4100, -4200, 0, 0, 0])
    assert grbl.send("$H\n") == "ok\r\n"
    low, high = HOME
    assert grbl.stands()[:3] == [low + PULL_OFF if mask >> ax & 1 else high - PULL_OFF for ax in range(3)]
    assert grbl.position()[:3] == [-100 * 250 + PULL_OFF if mask >> ax & 1 else -PULL_OFF for ax in range(3)]


def test_a_home_switch_that_is_closed_at_the_start(grbl: Grbl) -> None:
    grbl.place([1300, 1007, 0, 0, 0, 0])
    assert grbl.send("$H\n") == "ok\r\n"
    assert grbl.stands()[:3] == [HOME[1] - PULL_OFF] * 3


def test_axes_without_a_home_switch_look_for_their_limit() -> None:
    """A board may have one for Z alone."""
    grbl = made(home=4)
    assert grbl.send("$H\n") == "ok\r\n"
    assert grbl.stands()[:3] == [LIMIT[1] - PULL_OFF, LIMIT[1] - PULL_OFF, HOME[1] - PULL_OFF]
    grbl.close()


def test_a_limit_stays_a_limit_while_homing(grbl: Grbl) -> None:
    """A home switch that never closes: the limit behind it stops the axis before it hits anything."""
    grbl.homing(0, -(2**31), 2**31 - 1)
    assert grbl.send("$HX\n") == LOST
    assert grbl.stands()[0] == LIMIT[1]
    assert grbl.send("\x18").startswith(BANNER)


def test_a_home_switch_is_no_limit(grbl: Grbl) -> None:
    """Beyond it motion continues, and nothing of it is shown as a limit."""
    assert grbl.send("$H\n") == "ok\r\n"
    grbl.settings(s20=0)
    assert grbl.send("$X\nG91G0X2.4\n").endswith("ok\r\nok\r\n")
    assert grbl.stands()[0] == HOME[1] - PULL_OFF + 600 > HOME[1]
    assert "Pn:" not in grbl.status()


def test_a_switch_that_does_not_open_is_alarm_8(grbl: Grbl) -> None:
    grbl.place([-4000, 0, 0, 0, 0, 0])
    grbl.input("home-x", True)
    assert "ALARM:8" in grbl.send("$HX\n")


def test_an_inverted_one(grbl: Grbl) -> None:
    """`$5`: they read high when hit, as the limits do. Here all are open, so all are hit."""
    grbl.settings(s21=0, s5=1)
    assert "ALARM:8" in grbl.send("$HX\n")


def test_each_motor_of_a_gantry_finds_its_own() -> None:
    grbl = made(ganged=2)
    grbl.place([0, -4000, 0, 0, 0, 0])
    grbl.skew(1, 37)
    assert grbl.send("$H\n") == "ok\r\n"
    assert grbl.stands()[1] == grbl.second_stands()[1] == HOME[1] - PULL_OFF
    grbl.close()
