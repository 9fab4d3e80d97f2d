"""$210 ..: the driver of a later axis is the second motor of this one. From the next start on it is no axis."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from grbl_host import Grbl
from wificnc.simulator.library import HostBoard

REFUSED = {  # by core/gcode/status.h
    "no driver": "error:143\r\n",
    "earlier": "error:144\r\n",
    "taken": "error:145\r\n",
    "board": "error:146\r\n",
}


@contextmanager
def started(store: Path, axes: int = 6, ganged: int = 0, says: str = "") -> Iterator[Grbl]:
    controller = Grbl(axes=axes, store=store, ganged=ganged)
    assert says in controller.send("")
    try:
        yield controller
    finally:
        controller.after(0.1)
        controller.close()


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "settings"


def axes_of(controller: Grbl) -> int:
    match = re.search(r"MPos:([^|>]*)", controller.status())
    assert match
    return match[1].count(",") + 1


@pytest.mark.parametrize(
    ("settings", "axes"),
    [
        ({211: 4}, 3),
        ({211: 6}, 5),
        ({211: 5}, 4),
        ({210: 5, 211: 4}, 3),
        ({210: 3}, 2),  # a laser: X, Y and a second motor of X at Z
        ({211: 4, 79: 3}, 3),
        ({211: 4, 79: 2}, 2),
        ({211: 6, 79: 3}, 3),
    ],
)
def test_the_axis_of_the_driver_and_those_after_it_are_gone(store: Path, settings: dict[int, int], axes: int) -> None:
    with started(store) as controller:
        controller.fine(*(f"${number}={value}" for number, value in settings.items()))
        controller.after(0.1)
        assert axes_of(controller) == 6, "it counts from the next start on"
    with started(store) as controller:
        assert axes_of(controller) == axes
        letter = "XYZABC"[axes]
        for line in (f"G0{letter}1\n", f"$H{letter}\n", f"${100 + axes}=100\n"):
            assert "error" in controller.send(line), line
        listed = set(re.findall(r"^\$(\d+)=", controller.send("$$\n").replace("\r", ""), re.MULTILINE))
        assert f"{100 + axes - 1}" in listed and f"{100 + axes}" not in listed
        controller.fine(*(f"${number}=0" for number in settings))
    with started(store) as controller:
        assert axes_of(controller) == 6


@pytest.mark.parametrize(
    ("before", "line", "why"),
    [
        ((), "$211=2", "earlier"),
        ((), "$212=2", "earlier"),
        ((), "$210=1", "no driver"),  # X is an axis of every machine
        ((), "$215=6", "earlier"),
        (("$211=4",), "$212=4", "taken"),
        (("$212=6",), "$210=6", "taken"),
    ],
)
def test_what_no_machine_can_have_is_refused(store: Path, before: tuple[str, ...], line: str, why: str) -> None:
    with started(store) as controller:
        controller.fine(*before)
        settings = controller.send("$$\n")
        assert controller.send(line + "\n") == REFUSED[why]
        assert controller.send("$$\n") == settings


def test_a_number_that_is_no_axis_is_refused(store: Path) -> None:
    with started(store) as controller:
        assert controller.send("$211=7\n") == REFUSED["no driver"]
        assert controller.send("$211=-1\n") == "error:4\r\n"


def test_a_board_gives_only_drivers_that_it_has(store: Path) -> None:
    with started(store, axes=4) as controller:
        assert controller.send("$211=5\n") == REFUSED["no driver"]
        controller.fine("$211=4")


def test_an_axis_with_a_second_motor_by_its_board_file(store: Path) -> None:
    """It gets no other one, and its driver is none to spare."""
    with started(store, axes=4, ganged=0b1010) as controller:
        assert controller.send("$211=3\n") == REFUSED["board"]
        assert controller.send("$210=4\n") == REFUSED["no driver"]
        assert controller.send("$210=2\n") == REFUSED["no driver"]
        controller.fine("$210=3")


def test_it_can_be_changed_while_it_is_in_force(store: Path) -> None:
    with started(store) as controller:
        controller.fine("$211=4")
    with started(store) as controller:
        controller.fine("$211=5")
    with started(store) as controller:
        assert axes_of(controller) == 4


def test_settings_of_another_board_are_dropped_with_a_message(store: Path) -> None:
    with started(store) as controller:
        controller.fine("$211=6")
    with started(store, axes=4, says="[MSG:$211=0: this board has no pin for it]") as controller:
        assert axes_of(controller) == 4 and "$211=0\r\n" in controller.send("$$\n")


def test_of_two_that_want_a_driver_the_first_axis_gets_it(store: Path) -> None:
    """$213 was stored while A was an axis."""
    with started(store) as controller:
        controller.fine("$213=5")
    with started(store) as controller:
        controller.fine("$211=4")
    with started(store) as controller:
        controller.fine("$211=5")
    with started(store, says="[MSG:$213=0: this board has no pin for it]") as controller:
        assert axes_of(controller) == 4


def test_inputs_of_the_axes_that_are_gone_mean_nothing_but_those_of_second_motors(store: Path) -> None:
    with started(store) as controller:
        controller.fine("$211=4", "$21=1")
    with started(store) as controller:
        for name in ("limit-min-a", "limit-max-a", "limit-min-b"):
            controller.input(name, True)
        assert "Pn:" not in controller.status()
        controller.input("second-max-y", True)
        assert "ALARM:1" in controller.send("")


def test_without_a_limit_the_driver_is_a_second_motor_with_one_switch(store: Path) -> None:
    """Bit 3: the driver of A has no limit on this board."""
    no_limit = HostBoard(20_000_000, 1000, 500, 500_000, 6, switchless=1 << 3)
    for start in range(2):
        controller = Grbl(board=no_limit, store=store)
        controller.send("")
        if start == 0:
            controller.fine("$211=4")
        else:
            controller.fine("$22=1", "$24=600", "$25=3000", "$26=5", "$27=2", "$44=0", "$45=2", "$121=500", "$111=5000")
            controller.travel(1, -50_000, 250 * 10)
            controller.skew(1, 100)
            assert controller.send("$H\n") == "ok\r\n"
            assert controller.stands()[1] == 250 * 10 - 500
            assert controller.second_stands()[1] == 250 * 10 - 500 + 100, "it is as crooked as it was"
        controller.after(0.1)
        controller.close()
