"""A gantry whose second motor has no switch: both motors stop at the one switch, and each goes its own pull-off, once.
By the board (no limit is wired) or by $206."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from grbl_host import BANNER, LOCKED, Grbl
from wificnc.simulator.library import HostBoard

HIGH, LOW, PULL_OFF, ACCEL = 1007, -10003, 500, 500 * 250
SECOND_LIMIT = 1 << 6 + 1  # of Y, in host_board.switchless


@pytest.fixture(params=["board", "setting"])
def gantry(request: pytest.FixtureRequest) -> Iterator[Grbl]:
    by_board = SECOND_LIMIT if request.param == "board" else 0
    grbl = Grbl(board=HostBoard(20_000_000, 1000, 500, 500_000, 3, 2, switchless=by_board))
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)})
    grbl.travel(1, LOW, HIGH)
    grbl.settings(s22=1, s24=100, s25=2000, s26=25, s27=2, s44=2, s45=0, s131=100)
    if request.param == "setting":
        grbl.settings(s206=2)
    grbl.fine("$X")
    yield grbl
    grbl.close()


def ends(mask: int, second: int = PULL_OFF) -> list[int]:
    """Of both motors, steps."""
    return [LOW + PULL_OFF, LOW + second] if mask & 2 else [HIGH - PULL_OFF, HIGH - second]


def stand(gantry: Grbl) -> list[int]:
    return [gantry.stands()[1], gantry.second_stands()[1]]


def crooked(gantry: Grbl, at: int, skew: int) -> None:
    gantry.place([0, at, 0, 0, 0, 0])
    gantry.skew(1, skew)


@pytest.mark.parametrize("mask", [0, 2])
@pytest.mark.parametrize("skew", [0, 37, -250])
def test_both_motors_stop_at_the_one_switch(gantry: Grbl, mask: int, skew: int) -> None:
    """What the gantry is out of square stays, whether or not the second motor's line closes first."""
    gantry.settings(s23=mask)
    crooked(gantry, -4000, skew)
    assert gantry.send("$H\n") == "ok\r\n"
    first, second = ends(mask)
    assert stand(gantry) == [first, second + skew]


@pytest.mark.parametrize("mask", [0, 2])
@pytest.mark.parametrize("second_mm", [0.5, 1, 2.5, 4])
def test_the_second_pull_off_is_the_offset_that_squares(gantry: Grbl, mask: int, second_mm: float) -> None:
    """Once: homing again, or after another offset, does not add to it."""
    gantry.settings(s23=mask, s201=second_mm)
    crooked(gantry, -4000, 0)
    for _ in range(3):
        assert gantry.send("$H\n") == "ok\r\n"
        assert stand(gantry) == ends(mask, round(second_mm * 250))
    gantry.settings(s201=3)
    assert gantry.send("$HY\n") == "ok\r\n"
    assert stand(gantry) == ends(mask, 750)
    gantry.settings(s201=0)
    gantry.fine("G91G0Y-3")
    assert gantry.send("$HY\n") == "ok\r\n"
    assert stand(gantry) == ends(mask)


def test_the_second_line_means_nothing(gantry: Grbl) -> None:
    gantry.fine("$21=1")
    gantry.input("second-max-y", True)
    assert gantry.send("G91G0Y1\n") == "ok\r\n" and "Pn:" not in gantry.status()
    assert gantry.send("$H\n") == "ok\r\n"


def test_no_switch_is_alarm_9_within_the_travel(gantry: Grbl) -> None:
    gantry.travel(1, -200_000, 200_000)
    assert gantry.send("$HY\n").startswith("ALARM:9\r\n")
    assert stand(gantry)[0] == 150 * 250  # 1.5 travels


@pytest.mark.parametrize(("second_mm", "good"), [(6.9, True), (7.1, False)])
def test_a_gantry_is_not_bent_more_than_squaring_allows(gantry: Grbl, second_mm: float, good: bool) -> None:
    """5 % of 100 mm beyond $27, and the machine does not move."""
    gantry.settings(s201=second_mm)
    crooked(gantry, -4000, 0)
    assert gantry.send("$HY\n") == ("ok\r\n" if good else "error:142\r\n")
    assert good or stand(gantry) == [-4000, -4000]


@pytest.mark.parametrize("stop", ["estop", "reset", "door"])
def test_interrupted_at_any_moment(gantry: Grbl, stop: str) -> None:
    """Whatever one motor has gone alone by then counts: afterwards it is as square as if nothing had been."""
    gantry.settings(s201=4)
    for moment in np.arange(0.3, 3.6, 0.1):
        crooked(gantry, -2500, 0)
        gantry.after(float(moment), "$HY\n")
        gantry.input(stop, True)
        gantry.send("")
        gantry.input(stop, False)
        gantry.send("\x18")
        gantry.send("$X\n")
        gantry.settings(s201=0)
        assert gantry.send("$HY\n") == "ok\r\n", moment
        assert stand(gantry) == ends(0), moment
        gantry.settings(s201=4)


def test_an_alarm_leaves_the_motors_together(gantry: Grbl) -> None:
    gantry.travel(1, -200_000, 200_000)
    assert gantry.send("$HY\n") == "ALARM:9\r\nok\r\n" + BANNER + LOCKED
    gantry.send("$X\n")
    gantry.fine("G91G0Y-1")
    assert stand(gantry)[0] == stand(gantry)[1]


def test_limits_are_kept(gantry: Grbl) -> None:
    """No motor exceeds its acceleration while one of them goes alone."""
    gantry.settings(s201=4)
    gantry.record()
    assert gantry.send("$H\n") == "ok\r\n"
    assert np.abs(gantry.accelerations()).max() <= 1.005 * ACCEL + 4 / 0.01**2


def test_with_two_switches_again_they_count(gantry: Grbl) -> None:
    """$206 back to 0 (by the board there are none), and on again: the offset stays what two switches have made."""
    gantry.settings(s201=4, s206=0)
    assert gantry.send("$HY\n") == "ok\r\n"
    squared = stand(gantry)
    gantry.settings(s206=2)
    assert gantry.send("$HY\n") == "ok\r\n"
    assert stand(gantry) == squared == ends(0, 1000)
