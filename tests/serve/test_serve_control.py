"""Hands at the virtual machine: switches, probe, buttons, by lines at the control door."""

from __future__ import annotations

import pytest
from patience import wait_until
from serve_peer import Peer, Serve
from slow import deep_but
from wificnc.simulator.serve.server import Server


@pytest.fixture(params=deep_but("release".__eq__, ["release", "asan"]))
def server(request: pytest.FixtureRequest, serve: Serve) -> Server:
    return serve(speed=0.0, control=0, variant=request.param)


def doors(server: Server) -> tuple[Peer, Peer]:
    assert server.tcp and server.control
    return Peer.tcp(server.tcp), Peer.tcp(server.control, line_end=b"\n")


def say(hands: Peer, line: str) -> str:
    hands.send(line + "\n")
    return hands.line()


def test_probe_finds_the_surface(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, "surface -5.2") == "ok"
        sender.send("G38.2Z-20F300\n")
        said = sender.until("^ok$")
        assert next(line for line in said if line.startswith("[PRB:")).startswith("[PRB:0.000,0.000,-5.200,")


def test_hard_limit_at_the_end_of_travel(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, "travel x -1 10") == "ok"
        assert sender.ask("$21=1") == ["ok"]
        sender.send("G1X50F1000\n")
        sender.until("^ALARM:1$")
        assert 10.0 <= float(say(hands, "state").split()[1].split(",")[0]) < 12.0


def test_the_dial_is_turned(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert sender.ask("$401=0.1") == ["ok"]
        assert say(hands, "dial +5") == "ok"
        wait_until(lambda: sender.idle_position_mm()[0] == 0.5, "five detents")
        assert say(hands, "dial 1.5").startswith("error: dial DETENTS")
        assert say(hands, "dial 1 0").startswith("error: dial DETENTS")


def test_counters_count(server: Server) -> None:
    """Lines and blocks; a second move that comes when the first has ended is no starving: nothing was cut short."""
    sender, hands = doors(server)
    with sender, hands:
        settings = int(say(hands, "counters").split()[1])
        for line in ("G91", "G1X1F1000", "G77", "G1X1"):
            sender.ask(line)
        assert say(hands, "counters") == f"lines {settings + 4} blocks 2 starved 0 underruns 0 unmet 0"


def test_inputs_and_outputs(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert [say(hands, line) for line in ("input 1 on", "input-3", "analog 2 37.5")] == ["ok"] * 3
        sender.send("M66P1L3Q5\nG0X#5399\nM66E2\nG0Y#5399\nM66P0\nG0Z#5399\nM64P3\nM67E1Q12.5\n")
        assert [sender.line() for _ in range(8)] == ["ok"] * 8
        assert sender.idle_position_mm()[:3] == [1.0, 37.5, 0.0]
        assert say(hands, "state").endswith(" coolant 0 digital 8 analog 0,12.5,0,0")
        assert say(hands, "input 8 on").startswith("error: ") and say(hands, "analog 4 1").startswith("error: ")
        assert say(hands, "analog 0 101") == "error: analog N PERCENT"


def test_inputs_and_outputs_are_those_of_the_board(serve: Serve) -> None:
    """What the firmware of that board will say: it has one input and nothing analog."""
    server = serve(board="esp32s3-devkitc")
    assert server.tcp
    with Peer.tcp(server.tcp) as sender:
        assert [sender.ask(line) for line in ("M66P0", "M66P1", "M66E0", "M67E0Q1")] == [["ok"], *[["error:131"]] * 3]


def test_door_opens_and_closes(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, "door on") == "ok"
        while not sender.status().startswith("<Door:1"):
            pass
        assert say(hands, "door off") == "ok"
        sender.send("~")
        sender.idle_position_mm()


def test_estop_stops(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, "estop on") == "ok"
        sender.until("^ALARM:")


def test_a_crooked_gantry_is_squared(serve: Serve) -> None:
    server = serve(speed=0.0, control=0, board="host-gantry", settings=("$22=1", "$27=2", "$25=2000", "$24=100"))
    sender, hands = doors(server)
    with sender, hands:
        for line in ("travel x -150 20", "travel y -150 20", "travel z -150 20", "skew y 1.5"):
            assert say(hands, line) == "ok"
        assert " skew Y1.5000 " in say(hands, "state")
        sender.send("$H\n")
        sender.until("^ok$")
        state = say(hands, "state")
        assert state.startswith("position 18.0000,18.0000,18.0000,") and "skew" not in state


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("", "ok"),
        ("lift on", "error: no such command or input"),
        ("door ajar", "error: an input is on or off"),
        ("travel q 1 2", "error: which axis?"),
        ("travel x 2 1", "error: travel AXIS LOW HIGH, in mm"),
        ("surface 1e99", "error: surface Z, in mm, or off"),
        ("place", "error: place X Y Z, in mm"),
        ("place 1 2 3 4 5 6 7 8", "error: place X Y Z, in mm"),
        ("ramp fast", "error: ramp RPM, a second"),
        ("load 101", "error: load PERCENT, -100 to 100"),
        ("load", "error: load PERCENT, -100 to 100"),
        ("encoder 0", "error: encoder COUNTS, 1 to 65535"),
        ("load -10", "ok"),
        ("encoder 400", "ok"),
        ("skew y", "error: skew AXIS MM"),
        ("driver x hot", "error: this motor has no driver with registers"),
        (
            "driver q hot",
            "error: driver MOTOR ok|supply|wire|noise|hot|shut-down|short|open|undervoltage, MOTOR x, y2 ..",
        ),
        ("x" * 5000, "error: no such command or input"),
    ],
)
def test_answers(server: Server, line: str, answer: str) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, line) == answer


def test_the_clock_can_be_slowed_and_hurried(serve: Serve) -> None:
    """An hour of cutting is still there when it is looked at, and over when the clock is hurried."""
    sender, hands = doors(serve(speed=1.0, control=0))
    with sender, hands:
        assert sender.ask("G1X600F10") == ["ok"]
        assert say(hands, "speed 0.01") == "ok"
        assert sender.status().startswith("<Run")
        assert say(hands, "speed 100000") == "ok"
        assert sender.idle_position_mm()[0] == 600.0
        for wrong in ("speed", "speed 0", "speed -1", "speed fast", "speed 1 2", "speed nan", "speed 1e9"):
            assert say(hands, wrong) == "error: speed N, above 0 and up to 1000000: so many times real time"


def test_a_controller_without_a_clock_has_no_speed(server: Server) -> None:
    sender, hands = doors(server)
    with sender, hands:
        assert say(hands, "speed 2").startswith("error: this controller runs as fast as it can")


def test_the_status_light_follows_the_client_and_the_machine(serve: Serve) -> None:
    """The rows of targets/net/net_light.def that a computer can have."""
    server = serve(speed=1.0, control=0)
    assert server.control and server.tcp
    with Peer.tcp(server.control, line_end=b"\n") as hands:
        assert say(hands, "light") == "light JOINED"
        with Peer.tcp(server.tcp) as sender:
            assert sender.ask("G91") == ["ok"] and say(hands, "light") == "light READY"
            sender.ask("$J=X1000F60")
            assert say(hands, "light") == "light RUNNING"
            assert say(hands, "estop on") == "ok"
            sender.until("^ALARM:50$")
            assert say(hands, "light") == "light ALARM"
