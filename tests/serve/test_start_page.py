"""A start page, followed literally: the storage image that it makes, in a machine of three axes on a board of six."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from generate.board_docs import board_page
from serve_peer import Peer
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.firmware.nvs.image import read_image
from wificnc.firmware.nvs.values import NAMESPACE, setting_keys
from wificnc.profile import load_machine
from wificnc.simulator.serve.options import Address, ServeOptions, end_switches
from wificnc.simulator.serve.server import Server

BOARDS = ("esp32-wroom32", "esp32s3-devkitc")  # six axes


def line_of(page: str, begin: str) -> list[str]:
    """The words of a command that the page has."""
    found = re.search(rf"^{re.escape(begin)}.*$", page, re.MULTILINE)
    assert found, begin
    return shlex.split(found[0], comments=True)


def settings_of(image: Path) -> tuple[str, ...]:
    """What the firmware would load."""
    stored = read_image(image.read_bytes())
    lines = []
    for key in setting_keys():
        value = stored.get(NAMESPACE, key.key)
        if isinstance(value, int):
            number = memoryview(value.to_bytes(4, "little")).cast("f")[0] if key.type == "float" else value
            lines.append(f"${key.number}={number:g}")
    return tuple(lines)


def test_a_served_machine_has_a_switch_at_each_end_of_its_travel() -> None:
    """`wificnc serve --machine shapeoko3`, then homing: it once ended in ALARM:9. At power-on the tool is above the
    corner from which X and Y count up."""
    profile = load_machine("shapeoko3")
    hands = end_switches(profile)
    assert hands == ["travel x -10 415", "travel y -10 455", "travel z -70 10"]
    options = ServeOptions(
        board=load_board("esp32-wroom32"),
        tcp=Address("127.0.0.1", 0),
        speed=0.0,
        settings=tuple(profile.settings_lines()),
        hands=tuple(hands),
    )
    with Server(options) as server, Peer.tcp(server.tcp or "") as sender:
        for line in ("$21=1", "$22=1", "$H", "G53G0X-419", "G4P0", "$23=3", "$H"):
            assert sender.ask(line)[-1] == "ok", line
        assert sender.status().split("|")[:2] == ["<Idle", "MPos:-420.000,-460.000,-5.000"]


def test_the_profile_of_a_gantry_homes_square() -> None:
    """The driver of A is the second motor of Y, on a board of six axes."""
    profile = load_machine("gantry_router")
    options = ServeOptions(
        board=load_board("esp32-wroom32"),
        tcp=Address("127.0.0.1", 0),
        control=0,
        speed=0.0,
        settings=tuple(profile.settings_lines()),
        hands=(*end_switches(profile), "skew y 4.5"),
    )
    with (
        Server(options) as server,
        Peer.tcp(server.tcp or "") as sender,
        Peer.tcp(server.control or "", line_end=b"\n") as hands,
    ):
        assert sender.ask("$H")[-1] == "ok"
        assert sender.status().split("|")[:2] == ["<Idle", "MPos:-597.000,-797.000,-3.000"]
        hands.send("state\n")
        position, _, rest = hands.line().removeprefix("position ").partition(" ")
        assert position.split(",")[:3] == ["-7.0000", "-7.0000", "7.0000"] and not rest.startswith("skew")


@pytest.mark.parametrize(("travel_mm", "line"), [(8, "travel x -4 4"), (0, None)])
def test_a_short_travel_and_an_endless_one(travel_mm: float, line: str | None) -> None:
    profile = load_machine("shapeoko3")
    short = profile.axis.model_copy(update={"x": profile.axis.x.model_copy(update={"travel_mm": travel_mm or None})})
    lines = end_switches(profile.model_copy(update={"axis": short}))
    assert [each for each in lines if " x " in each] == ([line] if line else [])


@pytest.mark.parametrize("board_id", BOARDS)
def test_a_machine_of_three_axes_homes_on_a_board_of_six(
    board_id: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It once sought a switch of A, for 300 mm, and ended in ALARM:9."""
    page = board_page(load_board(board_id))
    monkeypatch.chdir(tmp_path)
    root.main(line_of(page, "wificnc nvs build")[1:], standalone_mode=False)
    board, stored = load_board(board_id), settings_of(tmp_path / "nvs.bin")
    assert len(board.axes) == 6
    options = ServeOptions(board=board, tcp=Address("127.0.0.1", 0), control=0, speed=0.0, settings=stored)
    with (
        Server(options) as server,
        Peer.tcp(server.tcp or "") as sender,
        Peer.tcp(server.control or "", line_end=b"\n") as hands,
    ):
        for axis, length in (("x", 425), ("y", 465), ("z", 80)):
            hands.send(f"travel {axis} {-length} 5\n")
            assert hands.line() == "ok"
        for line in ("$21=1", "$22=1", "$H"):
            assert sender.ask(line)[-1] == "ok", line
        assert sender.status().split("|")[:2] == ["<Idle", "MPos:-5.000,-5.000,-5.000"]
        hands.send("state\n")
        assert [float(mm) for mm in hands.line().split()[1].split(",")[3:]] == [0.0] * 3, "A, B and C stay"
