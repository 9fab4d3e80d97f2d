"""$79: a machine with fewer axes than its board. From the next start on the others are gone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from grbl_host import Grbl
from wificnc.board.load import load_board
from wificnc.profile import load_machine

ALL, THREE = 6, 3
ASKS = ("?", "$#\n", "$G\n")
FAR = 2**31 - 1


@contextmanager
def started(store: Path, axes: int = ALL) -> Iterator[Grbl]:
    controller = Grbl(axes=axes, store=store)
    controller.send("")
    try:
        yield controller
    finally:
        controller.close()


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Of a board with six axes whose machine has three."""
    path = tmp_path / "settings"
    with started(path) as controller:
        controller.fine(f"$79={THREE}")
        controller.after(0.1)
        assert controller.status().count(",") >= ALL - 1, "it counts from the next start on"
    return path


def settings_of(controller: Grbl) -> dict[str, str]:
    return dict(re.findall(r"^\$(\d+)=(.*)$", controller.send("$$\n").replace("\r", ""), re.MULTILINE))


def test_reports_are_those_of_a_board_with_three_axes(store: Path, tmp_path: Path) -> None:
    with started(store) as fewer, started(tmp_path / "own", THREE) as own:
        for ask in ASKS:
            assert fewer.send(ask) == own.send(ask)
        assert settings_of(fewer) == settings_of(own) | {"79": str(THREE)}
        assert "|MPos:0.000,0.000,0.000|" in fewer.status()


def test_words_and_settings_of_the_others_are_refused(store: Path, tmp_path: Path) -> None:
    with started(store) as fewer, started(tmp_path / "own", THREE) as own:
        for line in ("G0A1\n", "G1X1B2F100\n", "G92C0\n", "$103=100\n", "$J=G91A1F100\n", "$HA\n"):
            assert fewer.send(line) == own.send(line)
            assert "error" in own.send(line)


def test_homing_seeks_no_axis_that_is_not_there(store: Path) -> None:
    """Cycles that name A, B and C, as the board's own maker could have set them."""
    with started(store) as controller:
        controller.fine("$22=1", "$46=8", "$47=16", "$48=32", "$24=600", "$25=3000", "$26=5")
        controller.fine("$130=50", "$131=50", "$132=50")
        for axis in range(THREE):
            controller.travel(axis, -FAR, 250 * 10)
        assert controller.send("$H\n") == "ok\r\n"
        assert controller.state() == "Idle"
        assert controller.stands()[THREE:] == [0, 0, 0]


@pytest.mark.parametrize("board_id", ["esp32-wroom32", "esp32s3-devkitc", "esp32s3-devkitc-quad"])
def test_the_start_page_homes_a_three_axis_machine(tmp_path: Path, board_id: str) -> None:
    """`wificnc nvs build shapeoko3 --board BOARD`, a start, `$22=1` and `wificnc home`."""
    store, machine = tmp_path / "settings", load_machine("shapeoko3")
    axes = len(load_board(board_id).axes)
    with started(store, axes) as controller:
        for line in machine.settings_lines():
            assert controller.send(f"{line}\n").endswith("ok\r\n")
        controller.after(0.1)
    with started(store, axes) as controller:
        controller.fine("$22=1")
        for axis in range(THREE):
            controller.travel(axis, -FAR, 25 * 40)
        assert controller.send("$H\n") == "ok\r\n"
        assert controller.status().startswith("<Idle|MPos:-5.000,-5.000,-5.000|")


def test_an_input_that_floats_is_no_alarm(store: Path) -> None:
    with started(store) as controller:
        controller.fine("$21=1")
        controller.input("limit-a", True)
        controller.after(0.1)
        assert controller.state() == "Idle" and "|Pn:" not in controller.status()


def test_zero_brings_all_axes_back_with_their_settings(tmp_path: Path) -> None:
    path = tmp_path / "settings"
    with started(path) as controller:
        controller.fine("$103=321")
        controller.fine("$79=3")
        controller.after(0.1)
    with started(path) as controller:
        assert "103" not in settings_of(controller)
        controller.fine("$79=0")
        controller.after(0.1)
    with started(path) as controller:
        assert settings_of(controller)["103"] == "321.000"


def test_more_axes_than_the_board_has_are_those_of_the_board(tmp_path: Path) -> None:
    path = tmp_path / "settings"
    with started(path, THREE) as controller:
        controller.fine("$79=5")
        controller.after(0.1)
    with started(path, THREE) as controller:
        assert "|MPos:0.000,0.000,0.000|" in controller.status() and "103" not in settings_of(controller)


def test_a_profile_has_the_axes_of_its_machine() -> None:
    assert "$79=3" in load_machine("shapeoko3").settings_lines()
    assert "$79=4" in load_machine("rotary_4axis").settings_lines()
