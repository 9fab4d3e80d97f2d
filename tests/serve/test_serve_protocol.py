"""Issue, "The protocol, exactly", word by word against a running controller and a raw socket, as a sender meets it."""

from __future__ import annotations

import re

import pytest
from serve_peer import Peer, Serve

NUMBERS = r"-?[\d.]+(?:,-?[\d.]+){5}"


@pytest.fixture
def doors(serve: Serve):
    server = serve(control=0)
    assert server.tcp and server.control
    with Peer.tcp(server.tcp) as sender, Peer.tcp(server.control, line_end=b"\n") as hands:
        yield sender, hands


def do(hands: Peer, *lines: str) -> None:
    for line in lines:
        hands.send(line + "\n")
        assert hands.line() == "ok", line


def test_banner_and_dollar_commands(doors: tuple[Peer, Peer]) -> None:
    """Banner, `ok`/`error:N`, `$ $$ $# $G $I $I= $N $Nx= $x= $C $RST=#`."""
    sender, _ = doors
    sender.send("\x18")
    assert sender.until("^Grbl")[-1] == "Grbl 1.1h ['$' for help]"
    ends = {"$": r"\[HLP:", "$G": r"\[GC:G0 G54 ", "$I": r"\[START:[0-9A-F]{8}\]", "$#": r"\[PRB:" + NUMBERS + r":0\]"}
    for line, end in ends.items():
        *_, last, ok = sender.ask(line)
        assert re.match(end, last) and ok == "ok", line
    assert sender.ask("$N0=G21") == sender.ask("$I=TEST") == ["ok"]
    assert sender.ask("$N") == ["$N0=G21", "$N1=", "ok"] and ":TEST]" in sender.ask("$I")[0]
    assert sender.ask("$C") == ["[MSG:Enabled]", "ok"]
    assert sender.ask("G0X50") == ["ok"] and sender.status().startswith("<Check|MPos:0.000")
    sender.send("$C\n")
    assert sender.until(">G21:ok")[:2] == ["[MSG:Disabled]", "ok"]
    sender.send("$RST=#\n")
    assert sender.until(">G21:ok")[:2] == ["[MSG:Restoring defaults]", "ok"]
    assert sender.ask("G0X") == ["error:2"] and sender.ask("") == ["ok"]


def test_six_axis_settings_and_units(doors: tuple[Peer, Peer]) -> None:
    """All settings of Grbl 1.1h plus $100-$105 ... $130-$135, $40, with their unit conversions."""
    sender, _ = doors
    for base, value in ((100, 10), (110, 600), (120, 50), (130, 90)):
        for axis in range(6):
            assert sender.ask(f"${base + axis}={value + axis}") == ["ok"]
    listed = dict(line[1:].split("=") for line in sender.ask("$$")[:-1])
    assert (listed["105"], listed["113"], listed["124"], listed["135"]) == ("15.000", "603.000", "54.000", "95.000")
    assert sender.ask("$40=300") == sender.ask("$13=1") == sender.ask("G20") == ["ok"]
    assert sender.ask("G0X1A2C-3") == ["ok"]
    assert sender.idle_position_mm() == [1.0, 0.0, 0.0, 2.0, 0.0, -3.0]  # inches, and degrees


def test_states_jog_hold_door_and_sleep(doors: tuple[Peer, Peer]) -> None:
    """States and sub-states, overrides, safety door with resume, jogging with cancel, $SLP, $X."""
    sender, _ = doors
    sender.send("\x84")
    sender.until("Check Door")
    assert sender.status().startswith("<Door:0")
    sender.send("~")
    assert sender.idle_position_mm()[0] == 0.0
    sender.send("!")
    assert sender.status().startswith("<Hold:0")
    sender.send("G0X3\n~")
    assert sender.line() == "ok" and sender.idle_position_mm()[0] == 3.0
    assert sender.ask("$J=G91X2F500") == ["ok"] and sender.idle_position_mm()[0] == 5.0
    sender.send("$j= G91X50F500\n$J=G91X50F500\n\x85G0X6\n")
    assert [sender.line() for _ in range(3)] == ["ok"] * 3 and sender.idle_position_mm()[0] == 6.0
    sender.send("\x91\x96\x9b")
    assert any("Ov:110,50,90" in sender.status() for _ in range(3))
    assert sender.ask("$SLP") == ["ok"] and sender.line() == "[MSG:Sleeping]"
    sender.send("\x18")
    sender.until("unlock")
    assert sender.ask("G0X1") == ["error:9"] and sender.ask("$X") == ["[MSG:Caution: Unlocked]", "ok"]


@pytest.mark.parametrize("begin", ["$", "$J", "$J=", "$J=G91X"])
def test_half_a_jog_when_its_cancel_comes(doors: tuple[Peer, Peer], begin: str) -> None:
    """The rest of its line comes later: it is answered and does not run. Another line, and the next jog, do."""
    sender, _ = doors
    jog = b"$J=G91X2F1000\n"
    sender.send(begin.encode() + b"\x85")
    sender.send(jog[len(begin) :])
    assert sender.line() == "ok" and sender.idle_position_mm()[0] == 0.0
    sender.send(b"G0Y1\x85\n")
    assert sender.line() == "ok" and sender.idle_position_mm()[:2] == [0.0, 1.0]
    sender.send(jog)
    assert sender.line() == "ok" and sender.idle_position_mm()[:2] == [2.0, 1.0]


def test_switches_homing_and_probing(doors: tuple[Peer, Peer]) -> None:
    """Soft limits, hard limits, homing, G38.2-.5 with the exact trigger position, G43.1/G49, G92, G28/G30, M0/M30."""
    sender, hands = doors
    do(hands, "travel x -150 20", "travel y -150 20", "travel z -150 20", "surface -30")
    for line in ("$22=1", "$25=2000", "$24=100", "$27=2", "$20=1", "$21=1", "$133=0", "$134=0", "$135=0"):
        assert sender.ask(line) == ["ok"]
    assert sender.ask("$H") == ["ok"] and sender.idle_position_mm()[:3] == [-2.0, -2.0, -2.0]
    for move, z in (("G38.2Z-60", "-50.000"), ("G38.5Z20", "-49.996")):  # the switch at 20 mm is 0 now
        assert sender.ask(f"G91{move}F600") == [f"[PRB:-2.000,-2.000,{z},0.000,0.000,0.000:1]", "ok"]
    lines = ["G90G0Z-10", "G43.1Z2", "G49", "G92X0", "G92.1", "G28.1", "G30.1", "G0X-20", "G28Z-5", "G30"]
    assert [sender.ask(line) for line in lines] == [["ok"]] * len(lines)
    assert sender.idle_position_mm()[:3] == [-2.0, -2.0, -10.0]
    sender.send("M0\n")
    while not sender.status().startswith("<Hold:0"):
        pass  # `?` overtakes the line
    sender.send("~")
    assert sender.line() == "ok" and sender.ask("M30") == ["[MSG:Pgm End]", "ok"]
    sender.send("G0X5\n")
    assert "ALARM:2" in sender.until("^.MSG:Reset to continue")
    sender.send("\x18")
    sender.until("unlock")
    assert sender.ask("$X")[-1] == "ok"
    do(hands, "limit x")
    sender.until("^ALARM:1$")
