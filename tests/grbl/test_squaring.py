"""Issue: "squaring of ganged axes where the board has two motors". Alarm 10 dual-axis squaring failed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from grbl_host import BANNER, LOCKED, Grbl

ACCEL, PULL_OFF = 500 * 250, 500
HIGH, LOW = (1000, 1007, 1014), (-10000, -10003, -10006)


@pytest.fixture(params=[2, 3, 7, -2, -3, -7], ids=["Y", "XY", "XYZ", "Y by $211", "XY by $210", "XYZ by $210"])
def gantry(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Grbl]:
    """Negative: a board with six axes, whose last drivers are the second motors by settings."""
    grbl = ganged(request.param) if request.param > 0 else ganged_by_setting(-request.param, tmp_path / "settings")
    yield grbl
    grbl.close()


def ganged(mask: int) -> Grbl:
    return set_up(Grbl(ganged=mask))


def ganged_by_setting(mask: int, store: Path) -> Grbl:
    drivers = iter((4, 5, 6))
    six = Grbl(axes=6, store=store)
    six.send("")
    six.settings(**{f"s{210 + ax}": next(drivers) for ax in range(3) if mask >> ax & 1})
    six.after(0.1)
    six.close()
    return set_up(Grbl(axes=6, store=store))


def set_up(grbl: Grbl) -> Grbl:
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)})
    for axis in range(3):
        grbl.travel(axis, LOW[axis], HIGH[axis])
    grbl.settings(s22=1, s24=100, s25=2000, s26=25, s27=2, s130=100, s131=100, s132=100)
    return grbl


@pytest.mark.parametrize("mask", [0, 2, 7])
@pytest.mark.parametrize("skew", [0, 1, -1, 37, -250, 1000, -1200])
def test_both_motors_end_a_pull_off_before_their_switches(gantry: Grbl, mask: int, skew: int) -> None:
    """Both sides stand exactly a pull-off before their own switch, however crooked the gantry was."""
    gantry.settings(s23=mask)
    gantry.place([-4000, -4100, -4200, 0, 0, 0])
    gantry.skew(1, skew)
    assert gantry.send("$H\n") == "ok\r\n"
    ends = [LOW[ax] + PULL_OFF if mask >> ax & 1 else HIGH[ax] - PULL_OFF for ax in range(3)]
    assert gantry.stands()[:3] == gantry.second_stands()[:3] == ends
    assert gantry.position()[:3] == [-100 * 250 + PULL_OFF if mask >> ax & 1 else -PULL_OFF for ax in range(3)]


@pytest.mark.parametrize("mask", [0, 2, 7])
@pytest.mark.parametrize("skew", [0, 37, -250])
@pytest.mark.parametrize("second_mm", [1, 2.5, 4])
def test_each_motor_has_its_own_pull_off(gantry: Grbl, mask: int, skew: int, second_mm: float) -> None:
    """$201: the second motor of Y ends that far before its switch, the first one $27; no other axis changes."""
    gantry.settings(s23=mask, s201=second_mm)
    gantry.place([-4000, -4100, -4200, 0, 0, 0])
    gantry.skew(1, skew)
    assert gantry.send("$H\n") == "ok\r\n"
    ends = [LOW[ax] + PULL_OFF if mask >> ax & 1 else HIGH[ax] - PULL_OFF for ax in range(3)]
    second = round(second_mm * 250)
    second_end = LOW[1] + second if mask & 2 else HIGH[1] - second
    assert gantry.stands()[:3] == ends
    assert gantry.second_stands()[:3] == [ends[0], second_end, ends[2]]
    assert gantry.send("$H\n") == "ok\r\n"
    assert gantry.second_stands()[1] == second_end and gantry.stands()[:3] == ends


def test_a_second_pull_off_as_long_as_the_travel_is_refused() -> None:
    grbl = ganged(2)
    grbl.settings(s201=100)
    assert grbl.send("$HY\n") == "error:141\r\n"
    grbl.settings(s201=0)
    grbl.close()


@pytest.mark.parametrize("start", [(1000, 500), (500, 1000), (1000, 1000), (1300, 990)])
def test_switches_that_are_closed_at_the_start(gantry: Grbl, start: tuple[int, int]) -> None:
    """One switch, or both, closed before the first step."""
    gantry.place([0, start[0] + 7, 0, 0, 0, 0])
    gantry.skew(1, start[1] - start[0])
    assert gantry.send("$H\n") == "ok\r\n"
    assert gantry.stands()[1] == gantry.second_stands()[1] == HIGH[1] - PULL_OFF


def test_both_motors_make_every_step_of_a_program(gantry: Grbl) -> None:
    """Both motors step together in normal motion; a skew stays what it is."""
    gantry.skew(1, 60)
    for line in ("G1X3Y-7F900", "G2X5Y-7I1", "$J=X1Y1F900"):
        assert gantry.send(line + "\n") == "ok\r\n", line
    first, second = gantry.stands(), gantry.second_stands()
    assert first == gantry.position() and second[1] - first[1] == 60 and second[0] == first[0]


@pytest.mark.parametrize("skew", [1800, -1800, 3000])
def test_alarm_10(skew: int) -> None:
    """Alarm 10 dual-axis squaring failed: 5 % of the travel (100 mm) is as far as one side goes alone."""
    grbl = ganged(2)
    grbl.place([0, -4000, 0, 0, 0, 0])
    grbl.skew(1, skew)
    assert grbl.send("$HY\n") == "ALARM:10\r\nok\r\n" + BANNER + LOCKED
    alone = abs(grbl.second_stands()[1] - grbl.stands()[1])
    assert alone == pytest.approx(abs(skew) - 5 * 250, abs=1)  # no further
    before = grbl.stands(), grbl.second_stands()
    grbl.send("$X\n")
    grbl.send("G91G0Y-1\n")  # no one waits any more
    assert grbl.stands()[1] - before[0][1] == grbl.second_stands()[1] - before[1][1] == -250
    grbl.close()


def test_no_switch_at_all_is_alarm_9() -> None:
    grbl = ganged(2)
    grbl.travel(1, -200_000, 200_000)
    assert grbl.send("$HY\n").startswith("ALARM:9\r\n")
    grbl.close()


@pytest.mark.parametrize("stop", ["estop", "reset", "door"])
@pytest.mark.parametrize("moment", [0.3, 0.62, 0.9, 1.1, 1.3, 1.5, 1.8, 2.2, 2.6, 3.0])
def test_interrupted_at_any_moment(stop: str, moment: float) -> None:
    """E-stop, reset and door at any moment: afterwards both motors step again, and homing works."""
    grbl = ganged(2)
    grbl.place([0, -2500, 0, 0, 0, 0])
    grbl.skew(1, -700)
    grbl.after(moment, "$HY\n")
    grbl.input(stop, True)
    grbl.send("")
    grbl.input(stop, False)
    grbl.send("\x18")
    grbl.send("$X\n")
    before = grbl.stands(), grbl.second_stands()
    assert grbl.send("G91G0Y-1\n") == "ok\r\n"
    assert grbl.stands()[1] - before[0][1] == grbl.second_stands()[1] - before[1][1] == -250
    assert grbl.send("$HY\n") == "ok\r\n" and grbl.stands()[1] == grbl.second_stands()[1] == HIGH[1] - PULL_OFF
    grbl.close()


def test_the_second_switch_is_a_hard_limit(gantry: Grbl) -> None:
    """$21: either switch of a ganged axis stops the machine, at that step."""
    gantry.fine("$21=1")
    gantry.skew(1, 200)
    assert gantry.send("G1Y20F3000\n").startswith("ok\r\nALARM:1\r\n")
    assert gantry.second_stands()[1] == HIGH[1] and gantry.stands()[1] == HIGH[1] - 200


def test_limits_are_kept(gantry: Grbl) -> None:
    """Design invariant 2: no motor exceeds its acceleration, when one waits and when it continues."""
    gantry.place([-3000, -3000, -1000, 0, 0, 0])
    gantry.skew(1, 613)
    gantry.record()
    assert gantry.send("$H\n") == "ok\r\n"
    grain = 4 / 0.01**2
    assert np.abs(gantry.accelerations()).max() <= 1.005 * ACCEL + grain


def test_second_motors_of_other_boards_are_not_looked_at(grbl: Grbl) -> None:
    """A board without a second motor: its line means nothing."""
    grbl.fine("$21=1")
    grbl.input("second-max-y", True)
    assert grbl.send("G0X1\n") == "ok\r\n" and "Pn:" not in grbl.status()
