"""Which axes know where they are: homed, and not stopped hard since. Homing some axes unlocks no others."""

from __future__ import annotations

import re

import pytest
from grbl_host import BANNER, LOCKED, Grbl
from test_switches import make_homing


def lose(grbl: Grbl) -> None:
    """Reset in motion: the motors may have missed steps."""
    grbl.after(0.3, "G1X-5Y-5Z-5F1000\n")
    assert "ALARM:3" in grbl.send("\x18") and grbl.state() == "Alarm"


def homed(grbl: Grbl) -> str:
    """The field of the report that says so."""
    found = re.search(r"\|H:([\d,]+)", "".join(grbl.status() for _ in range(12)))
    return found[1] if found else ""


def test_homing_one_axis_unlocks_when_the_others_are_trusted_too(grbl: Grbl) -> None:
    """After a lost position `$HX` leaves the machine locked until every axis of the homing cycles is homed."""
    make_homing(grbl)
    grbl.fine("$20=1")
    lose(grbl)
    assert grbl.send("$HX\n") == "[MSG:Not homed: YZ]\r\nok\r\n" and grbl.state() == "Alarm"
    assert grbl.send("G0Y-1\n") == "error:9\r\n" and grbl.send("$J=Y-1F100\n") == "error:8\r\n"
    assert grbl.send("$HZ\n") == "[MSG:Not homed: Y]\r\nok\r\n" and grbl.state() == "Alarm"
    assert grbl.send("$HY\n") == "ok\r\n" and grbl.state() == "Idle"
    assert grbl.position()[:3] == [-500] * 3 and grbl.stands()[:3] == [500, 507, 514]


def test_unlocking_says_what_is_not_homed(grbl: Grbl) -> None:
    """Soft limits count from a zero that no one has found: who unlocks gets a message."""
    make_homing(grbl)
    lose(grbl)
    grbl.send("$HX\n")
    assert grbl.send("$X\n") == "[MSG:Caution: Unlocked]\r\n[MSG:Not homed: YZ]\r\nok\r\n"
    assert grbl.state() == "Idle"
    assert grbl.send("$HY\n") == "ok\r\n" and grbl.state() == "Idle", "unlocked by hand, it stays so"


def test_reports_name_the_homed_axes(grbl: Grbl) -> None:
    """`H:`, as grblHAL: 1 when every axis of the homing cycles is homed, else 0 and a mask of those that are."""
    assert homed(grbl) == "", "without homing ($22) there is nothing to say"
    make_homing(grbl)
    assert homed(grbl) == "0,0"
    grbl.send("$HY\n")
    assert homed(grbl) == "0,2"
    grbl.send("$H\n")
    assert homed(grbl) == "1"
    lose(grbl)
    assert homed(grbl) == "0,0"


def test_failed_homing_leaves_its_axis_untrusted(grbl: Grbl) -> None:
    """It has moved against a counter that it was about to replace."""
    make_homing(grbl)
    assert grbl.send("$H\n") == "ok\r\n"
    grbl.travel(0, -100000, 100000)
    assert grbl.send("$HX\n") == "ALARM:9\r\nok\r\n" + BANNER + LOCKED
    assert homed(grbl) == "0,6"


@pytest.mark.parametrize("line", ["$100=200", "$80=1"])
def test_steps_of_another_size_are_another_place(grbl: Grbl, line: str) -> None:
    make_homing(grbl)
    grbl.send("$H\n")
    grbl.send(line + "\n")
    assert homed(grbl).startswith("0,")


def test_a_pull_off_longer_than_the_travel_is_refused(grbl: Grbl) -> None:
    """`$27` above `$130` would drive the axis into its other end."""
    make_homing(grbl)
    grbl.fine("$27=41")
    at = grbl.stands()
    assert grbl.send("$H\n") == grbl.send("$HX\n") == "error:141\r\n" and grbl.stands() == at
    assert grbl.state() == "Idle" and grbl.send("$HZ\n") != "error:141\r\n"


@pytest.mark.parametrize("mask", [0, 7])
@pytest.mark.parametrize(("pull_off_mm", "steps"), [(1.001, 250), (1.003, 251), (1.999, 500)])
def test_a_homed_position_is_the_nearest_step(grbl: Grbl, mask: int, pull_off_mm: float, steps: int) -> None:
    """A pull-off between two steps: counter and machine stand at the nearest, on both ends of the travel."""
    make_homing(grbl, mask)
    grbl.settings(s27=pull_off_mm)
    assert grbl.send("$H\n") == "ok\r\n"
    assert grbl.position()[:3] == [-250 * (40 + ax) + steps if mask else -steps for ax in range(3)]
    switches = [-10000 - 3 * ax if mask else 1000 + 7 * ax for ax in range(3)]
    assert grbl.stands()[:3] == [at + steps if mask else at - steps for at in switches]


def test_the_slow_approach_ends_five_pull_offs_on(grbl: Grbl) -> None:
    """A switch that fails after it was found once: the approach seeks it for 5 times `$27` and no further."""
    make_homing(grbl)
    grbl.put("$HX\n")
    while grbl.stands()[0] < 1000:
        grbl.after(0.01)
    grbl.travel(0, -100000, 100000)
    assert grbl.send("").startswith("ALARM:9\r\n")
    assert grbl.stands()[0] == 1000 - 500 + 5 * 500


def test_axes_of_no_cycle_are_not_sought() -> None:
    """A board of six axes on a machine of three: `$H` homes X, Y and Z. The others are homed by their letter, or
    when a cycle has them."""
    grbl = Grbl(axes=6)
    grbl.send("")
    make_homing(grbl)
    assert grbl.send("$H\n") == "ok\r\n" and grbl.stands()[3:] == [0, 0, 0]
    assert grbl.state() == "Idle" and homed(grbl) == "1"
    grbl.close()


@pytest.mark.parametrize(("switch", "setting"), [("estop", "$21=0"), ("limit-max-y", "$21=1")])
@pytest.mark.parametrize("delay_s", [0.0005, 0.013, 0.2, 0.4003])
def test_a_stop_by_the_edge_of_a_switch_loses_the_position(
    grbl: Grbl, switch: str, setting: str, delay_s: float
) -> None:
    """The interrupt of the switch stops the steps before the controller looks: that motors moved is not forgotten."""
    make_homing(grbl)
    grbl.send("$H\n")
    grbl.fine(setting)
    assert homed(grbl) == "1"
    grbl.after(0.1, "G91G1X-30F3000\n")
    at = grbl.position()
    grbl.input_in(delay_s, switch, True)
    grbl.after(1)
    assert grbl.position() != at
    grbl.input(switch, False)
    grbl.send("\x18")
    assert homed(grbl) == "0,0"


def test_a_stop_at_rest_loses_nothing(grbl: Grbl) -> None:
    make_homing(grbl)
    grbl.send("$H\n")
    grbl.input("estop", True)
    grbl.after(1)
    grbl.input("estop", False)
    grbl.send("\x18")
    assert homed(grbl) == "1"
