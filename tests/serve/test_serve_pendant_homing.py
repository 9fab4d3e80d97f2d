"""A pendant that vanishes while the machine homes."""

from __future__ import annotations

from patience import wait_until
from serve_peer import Peer, Serve
from wificnc.simulator.serve.options import Door
from wificnc.simulator.serve.server import Server

TCP = Door("tcp", "0")
HOMING = ("$22=1", "$20=0", "$25=2000", "$24=100", "$27=2")


def hands_of(server: Server) -> Peer:
    """Switches at both ends; reports are not answered while it homes, so the hands say where the tool is."""
    hands = Peer.tcp(server.control or "", line_end=b"\n")
    for axis in "xyz":
        assert say(hands, f"travel {axis} -150 40") == "ok"
    return hands


def say(hands: Peer, line: str) -> str:
    hands.send(line + "\n")
    return hands.line()


def place(hands: Peer) -> str:
    return say(hands, "state").split(" ")[1]


def wait_for_motion(hands: Peer) -> None:
    begin = place(hands)
    wait_until(lambda: place(hands) != begin, "homing moves")


def test_homing_that_a_pendant_began_stops_when_it_vanishes(serve: Serve) -> None:
    """As that of a lost sender: a place that is half found is none, and nothing moves any more."""
    server = serve(speed=1.0, control=0, pendant=TCP, settings=HOMING)
    assert server.pendant
    with Peer.tcp(server.tcp or "") as sender, hands_of(server) as hands:
        sender.ask("$G")
        with Peer.tcp(server.pendant) as pendant:
            pendant.send("$H\n")
            wait_for_motion(hands)
        lines = sender.until("homing stopped")
        assert any("ALARM:6" in line for line in lines)
        assert sender.ask("G0 X1")[-1] == "error:9"
        report = sender.status()
        assert report.startswith("<Alarm") and "|H:1" not in report
        stopped = place(hands)
        with Peer.tcp(server.pendant) as again:
            assert again.ask("$G")[-1] in ("ok", "error:9")
        assert place(hands) == stopped
        assert sender.ask("$X")[-1] == "ok"
        assert sender.ask("G4 P0.1")[-1] == "ok"
        assert place(hands) == stopped


def test_homing_of_the_sender_continues_when_a_pendant_vanishes(serve: Serve) -> None:
    server = serve(speed=1.0, control=0, pendant=TCP, settings=HOMING)
    assert server.pendant
    with Peer.tcp(server.tcp or "") as sender, hands_of(server) as hands:
        sender.ask("$G")
        with Peer.tcp(server.pendant) as pendant:
            assert pendant.ask("$G")[-1] == "ok"
            sender.send("$H\n")
            wait_for_motion(hands)
            pendant.send("$J=G91 X-5 F600\n")
            assert pendant.until("^(ok|error)")[-1] == "error:183"
        lines = sender.until("^(ok|error)")
        assert lines[-1] == "ok" and not any("ALARM" in line for line in lines)
        assert sender.status().startswith("<Idle")
