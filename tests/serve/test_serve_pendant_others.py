"""A pendant, a sender and others that act at the same time: what each is answered, and what moves in the end."""

from __future__ import annotations

import json
import os
import re
import socket

import pytest
from click.testing import CliRunner
from patience import wait_until
from serve_peer import SLOW, Peer, Serve, clock
from wificnc.app import root
from wificnc.errors import RefusedError
from wificnc.simulator.serve.options import Door
from wificnc.simulator.serve.server import Server

TCP = Door("tcp", "0")
NO_SOFT_LIMITS = ("$20=0",)
MPG = b"\x8b"

# the ports of WMC3 are fixed: every run of the tests has an address of its own
ADDRESS = f"127.59.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"
try:
    socket.create_server((ADDRESS, 0)).close()
except OSError:  # where 127.0.0.1 is the only address of this kind
    ADDRESS = "127.0.0.1"


def sender_of(server: Server) -> Peer:
    assert server.tcp
    return Peer.tcp(server.tcp)


def pendant_of(server: Server) -> Peer:
    assert server.pendant
    return Peer.tcp(server.pendant)


def state_of(peer: Peer) -> str:
    found = re.match("<([A-Za-z]+)", peer.status())
    assert found
    return found[1]


def wait_for_state(peer: Peer, state: str) -> None:
    wait_until(lambda: state_of(peer) == state, state)


def wmc3(*arguments: str) -> str:
    result = CliRunner().invoke(root, ["wmc3", arguments[0], "--to", ADDRESS, *arguments[1:]])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


def test_control_by_a_pendant_keeps_remote_hosts_out(serve: Serve) -> None:
    """One hand only: no motion, homing or output of a WMC3 host while an MPG is in control; it may hold and stop."""
    server = serve(speed=1.0, pendant=TCP, pendant_kind="mpg", settings=NO_SOFT_LIMITS, wmc3=ADDRESS)
    with sender_of(server) as sender, pendant_of(server) as peer:
        sender.ask("")
        peer.send(MPG)
        peer.until("in control")
        with pytest.raises(RefusedError):
            wmc3("motion", "X=100")
        with pytest.raises(RefusedError):
            wmc3("home", "X")
        assert peer.ask("$J=G91 X1 F600")[-1] == "ok"
        assert peer.idle_position_mm()[0] == 1.0
        wmc3("hold")
        wmc3("resume")
        peer.send(MPG)
        peer.until("released")
        assert json.loads(wmc3("motion", "X=250", "--json"))["executed"] > 0
        wait_until(lambda: sender.idle_position_mm()[0] == 2.0, "the motion")  # older reports come first


def test_a_sender_that_connects_in_a_pendants_turn_gets_its_answers(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=NO_SOFT_LIMITS)
    with pendant_of(server) as peer:
        peer.send("G4 P0.3\n")
        with sender_of(server) as sender:
            assert [line[:4] for line in sender.ask("$G") if not line.startswith("[MSG")] == ["[GC:", "ok"]
        assert peer.until("^(ok|error)")[-1] == "ok"


def test_it_vanishes_while_it_jogs_in_a_parked_hold(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=NO_SOFT_LIMITS)
    with sender_of(server) as sender:
        sender.send("G1 X3 F1200\nM0\nG1 X6\n")
        with pendant_of(server) as peer:
            wait_for_state(peer, "Hold")
            peer.send(b"\xa3")
            peer.until("Parked")
            assert peer.ask("$J=G91 Z300 F1200")[-1] == "ok"
            wait_until(lambda: "MPos:3.000,0.000,0.000" not in peer.status(), "the jog moves")
        wait_until(lambda: z_of(sender) == z_of(sender) != 0.0, "the jog ends")
        assert z_of(sender) < 300.0
        sender.send("~")
        wait_for_state(sender, "Idle")
        assert sender.idle_position_mm()[:3] == [6.0, 0.0, 0.0]


def z_of(peer: Peer) -> float:
    found = re.search(r"MPos:[-\d.]+,[-\d.]+,([-\d.]+)", peer.status())
    assert found
    return float(found[1])


def test_in_a_parked_hold_each_side_has_its_answers(serve: Serve) -> None:
    """The sender's operator lines, the pendant's, and the job's that wait."""
    server = serve(speed=1.0, pendant=TCP, settings=NO_SOFT_LIMITS)
    with sender_of(server) as sender, pendant_of(server) as peer:
        sender.send("G1 X3 F1200\nM0\nG1 X6\n")
        wait_for_state(peer, "Hold")
        sender.send(b"\xa3")
        sender.until("Parked")
        peer.until("Parked")
        sender.send("$J=G91 Z1 F600\n$J=G91 Z1 F300\n$G\n")
        peer.send("$#\n$J=G91 Z1 F300\n")
        assert "[PRB" in peer.until("^ok$")[-2]
        assert peer.until("^(ok|error)")[-1] == "ok"
        lines = [line for _ in range(3) for line in sender.until("^(ok|error)") if line[0] not in "<"]
        assert [line[:4] for line in lines if "MSG" not in line] == ["ok", "ok", "[GC:", "ok"]
        sender.send("~")
        for _ in range(2):
            assert sender.until("^(ok|error)")[-1] == "ok"
        assert sender.idle_position_mm()[:3] == [6.0, 0.0, 0.0]


def test_check_mode_of_a_pendant_locks_no_one_out(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=NO_SOFT_LIMITS)
    with sender_of(server) as sender, pendant_of(server) as peer:
        sender.ask("")
        assert peer.ask("$C")[-1] == "ok"
        assert sender.ask("G0 X1")[-1] == "ok"
        assert peer.ask("$C")[-1] == "ok"
        sender.until("^Grbl")
        assert sender.ask("G0 X2")[-1] == "ok"
        assert sender.idle_position_mm()[0] == 2.0


def test_a_sender_lost_in_a_pendants_jog_is_held_after_it(serve: Serve) -> None:
    server = serve(speed=SLOW, pendant=TCP, settings=NO_SOFT_LIMITS, control=0)
    with pendant_of(server) as peer:
        with sender_of(server) as sender:
            sender.ask("")
            assert peer.ask("$J=G91 X3 F1200")[-1] == "ok"
            sender.send("G0 X50\n")
            assert sender.status()
        clock(server, 1.0)
        peer.until("Sender lost: feed hold")
        assert state_of(peer) == "Hold"
        assert "MPos:3.000," in peer.status()


def test_a_cancel_of_the_sender_ends_all_jogs_of_a_pendant(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=NO_SOFT_LIMITS)
    with sender_of(server) as sender, pendant_of(server) as peer:
        sender.ask("")
        peer.send("$J=G91 X5 F2000\n" * 60)
        wait_for_state(sender, "Jog")
        sender.send(b"\x85")
        assert [peer.until("^(ok|error)")[-1] for _ in range(60)]
        stopped = sender.idle_position_mm()
        assert peer.ask("G4 P0")[-1] == "ok"
        assert sender.idle_position_mm() == stopped
        assert stopped[0] < 295.0
