"""A pendant at its own port, next to a sender: what FluidDial says to a controller, what a plain MPG of grblHAL says,
and what happens when either vanishes or sends garbage while it jogs.

The conversations are written from what such pendants send and wait for: FluidDial sends one line and waits for its
answer, asks for automatic reports, and cancels a jog when its key is released."""

from __future__ import annotations

import os
import pty
import re
import tty
from pathlib import Path

import pytest
from serve_peer import SLOW, Peer, Serve, clock
from wificnc.simulator.serve.options import Door
from wificnc.simulator.serve.server import Server

TCP = Door("tcp", "0")
BUSY = "error:183"
FAR_JOG = "$J=G91 G21 X400 F2000"
HOMES = ("$20=0",)


def pendant_of(server: Server) -> Peer:
    assert server.pendant
    return Peer.tcp(server.pendant)


def place_mm(peer: Peer) -> list[float]:
    """X, Y and Z at rest: a dwell of this client waits for what moves, and reports before its answer are old."""
    assert peer.ask("G4 P0")[-1] == "ok"
    return peer.idle_position_mm()[:3]


class FluidDial:
    """Its side of the conversation: a line, then its answer, and status reports whenever they come."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.news: list[str] = []

    def start(self) -> None:
        """Power-on: it asks until someone answers, then what it needs for its screens."""
        self.peer.send("\x11?")
        self.state()
        self.peer.send("\x11\x0c")
        assert any(line.startswith("[GC:") for line in self.line("$G"))
        self.line("$RI=200")
        for item in ("$/axes/x/homing/cycle", "$Localfs/ListGcode=/"):  # FluidNC's; they need an answer
            assert self.line(item)[-1] in ("error:2", "error:3")

    def line(self, text: str) -> list[str]:
        return self.peer.ask(text)

    def state(self) -> str:
        """Of the next report."""
        found = re.match("<([A-Za-z]+)", self.peer.until("^<")[-1])
        assert found
        return found[1]

    def until_state(self, state: str) -> None:
        self.peer.until(rf"^<{state}\b")

    def key(self, byte: int) -> None:
        self.peer.send(bytes([byte]))


HOLD, RESUME, RESET, CANCEL, FEED_UP, MPG = ord("!"), ord("~"), 0x18, 0x85, 0x91, 0x8B


def test_fluiddial_jogs_next_to_a_sender(serve: Serve) -> None:
    """The sender stays the owner and gets its own answers; the pendant gets the reports it has asked for, again after
    a reset when it asks again."""
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        assert sender.ask("G21")[-1] == "ok"
        dial = FluidDial(peer)
        dial.start()
        assert dial.line("$J=G91 G21 X0.1 F1000")[-1] == "ok"
        assert place_mm(sender)[0] == 0.1
        assert sender.ask("G0 X2")[-1] == "ok"
        assert place_mm(sender)[0] == 2.0
        assert dial.line("G10L20P0X0")[-1] == "ok"
        assert "[G54:2.000,0.000,0.000,0.000,0.000,0.000]" in dial.line("$#")
        dial.key(RESET)
        peer.until("^Grbl")
        assert dial.line("$X")[-1] == "ok"
        dial.line("$RI=200")
        dial.until_state("Idle")


def test_a_held_key_jogs_until_it_is_released(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        sender.ask("")
        dial = FluidDial(peer)
        dial.line("$RI=50")
        assert dial.line(FAR_JOG)[-1] == "ok"
        dial.until_state("Jog")
        dial.key(CANCEL)
        dial.until_state("Idle")
        assert 0.0 < place_mm(sender)[0] < 399.0


def test_while_a_job_runs_the_pendant_holds_resumes_and_overrides_and_moves_nothing(serve: Serve) -> None:
    server = serve(speed=SLOW, pendant=TCP, settings=HOMES, control=0)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        assert sender.ask("G1 X20 F1200")[-1] == "ok"
        dial = FluidDial(peer)
        dial.line("$RI=50")
        dial.until_state("Run")
        refused = dial.line("$J=G91 X-5 F1000")
        assert refused[-1] == BUSY
        assert any("a job runs" in line for line in refused)
        dial.key(FEED_UP)
        peer.until(r"\|Ov:110,")
        dial.key(HOLD)
        dial.until_state("Hold")
        assert dial.line("G0 X-5")[-1] == BUSY
        dial.key(RESUME)
        dial.until_state("Run")
        clock(server, 4.0)
        dial.until_state("Idle")
        assert place_mm(sender)[0] == 20.0


def test_in_a_parked_hold_the_pendant_jogs_and_the_job_continues(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        sender.send("G1 X3 F1200\nM0\nG1 X6\n")
        dial = FluidDial(peer)
        dial.line("$RI=50")
        dial.until_state("Hold")
        peer.send(b"\xa3")
        peer.until("Parked")
        assert dial.line("$J=G91 Z2 F1000")[-1] == "ok"
        peer.until(r"MPos:3\.000,0\.000,2\.000")
        dial.key(RESUME)
        assert sender.until("^ok$")[-1] == "ok"
        sender.until("^ok$")
        sender.until("^ok$")
        assert place_mm(sender) == [6.0, 0.0, 0.0]


def test_lines_of_the_sender_wait_while_the_pendant_jogs(serve: Serve) -> None:
    """Each side has exactly its own answers."""
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        sender.ask("")
        dial = FluidDial(peer)
        assert dial.line("$J=G91 X2 F600")[-1] == "ok"
        sender.send("G0 X0\nG4 P0\n")
        assert sender.until("^(ok|error)")[-1] == "ok"
        assert sender.until("^(ok|error)")[-1] == "ok"
        assert place_mm(sender)[0] == 0.0
        assert "ok" not in peer.heard()


def test_it_vanishes_while_it_jogs(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender:
        sender.ask("")
        with pendant_of(server) as peer:
            dial = FluidDial(peer)
            dial.line("$RI=50")
            assert dial.line(FAR_JOG)[-1] == "ok"
            assert dial.line(FAR_JOG)[-1] == "ok"
            dial.until_state("Jog")
        sender.until("jog cancelled")
        stopped = place_mm(sender)
        assert 0.0 < stopped[0] < 399.0
        with pendant_of(server) as again:  # nothing of the old one starts when it is back
            FluidDial(again).line("$G")
            assert place_mm(sender) == stopped


def test_garbage_moves_nothing_and_is_one_message(serve: Serve) -> None:
    """Each of its lines has an answer, so that a pendant that was only dirty for a moment continues."""
    server = serve(speed=1.0, pendant=TCP, settings=HOMES)
    noise = bytes(byte for byte in range(1, 0x80) if byte not in b"\x11\x13\x18!?~")
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        sender.ask("")
        for _ in range(5):
            peer.send(noise + b"\n")
        peer.send("$G\n")
        lines = peer.until(r"^ok$")
        assert sum("unreadable" in line for line in lines) == 1
        assert sum(line.startswith("error:11") for line in lines) >= 5
        assert place_mm(sender) == [0.0, 0.0, 0.0]


def test_an_mpg_takes_control_and_returns_it(serve: Serve) -> None:
    """As grblHAL's: 0x8B on its own port, MPG:1 and MPG:0 in the reports, lines of the sender refused meanwhile."""
    server = serve(speed=1.0, pendant=TCP, pendant_kind="mpg", settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        assert sender.ask("G21")[-1] == "ok"
        mpg = FluidDial(peer)
        assert mpg.line("$J=G91 X1 F600")[-1] == BUSY  # not in control
        mpg.key(MPG)
        peer.until("in control")
        sender.heard()
        assert "|MPG:1" in sender.status()
        assert "|MPG:" not in sender.status()
        assert mpg.line("$J=G91 X1 F600")[-1] == "ok"
        assert mpg.line("$J=G91 X1 F600")[-1] == "ok"
        refused = sender.ask("G0 X50")
        assert refused[-1] == BUSY
        assert any("(MPG)" in line for line in refused)
        sender.send("\x87")
        assert "|MPG:1" in sender.until("^<")[-1]
        assert peer.idle_position_mm()[0] == 2.0
        mpg.key(MPG)
        peer.until("released")
        sender.send("?")
        sender.until(r"\|MPG:0")
        assert sender.ask("G0 X3")[-1] == "ok"
        assert place_mm(sender)[0] == 3.0


def test_an_mpg_gets_no_control_of_a_running_job(serve: Serve) -> None:
    server = serve(speed=SLOW, pendant=TCP, pendant_kind="mpg", settings=HOMES, control=0)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        assert sender.ask("G1 X10 F1200")[-1] == "ok"
        peer.send(bytes([MPG]))
        peer.until("machine at rest")
        clock(server, 4.0)
        assert place_mm(sender)[0] == 10.0
        assert sender.ask("G0 X0")[-1] == "ok"


def test_an_mpg_that_vanishes_gives_control_back(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, pendant_kind="mpg", settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender:
        sender.ask("")
        with pendant_of(server) as peer:
            mpg = FluidDial(peer)
            mpg.key(MPG)
            peer.until("in control")
            assert mpg.line(FAR_JOG)[-1] == "ok"
        sender.until("released")
        sender.until("jog cancelled")
        assert place_mm(sender)[0] < 399.0
        assert sender.ask("G0 X0")[-1] == "ok"


@pytest.mark.skipif(os.name == "nt", reason="there are no pseudo-terminals")
def test_a_pendant_at_a_pty(serve: Serve, tmp_path: Path) -> None:
    """Each opening is a new pendant."""
    link = tmp_path / "pendant"
    serve(speed=1.0, pendant=Door("pty", str(link)), settings=HOMES)
    for _ in range(2):
        with Peer.serial(link) as peer:
            FluidDial(peer).start()


@pytest.mark.skipif(os.name == "nt", reason="there are no pseudo-terminals")
def test_a_pendant_at_a_serial_port(serve: Serve) -> None:
    master, slave = pty.openpty()
    tty.setraw(master)
    name = os.ttyname(slave)
    os.set_blocking(master, False)
    try:
        serve(speed=1.0, pendant=Door("serial", name), settings=HOMES)
        FluidDial(Peer(master)).start()
    finally:
        os.close(slave)
        os.close(master)


def test_an_mpg_that_has_returned_control_is_not_read(serve: Serve) -> None:
    """It may look and stop, as before it took control; the next 0x8B takes control again."""
    server = serve(speed=1.0, pendant=TCP, pendant_kind="mpg", settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        assert sender.ask("G21")[-1] == "ok"
        mpg = FluidDial(peer)
        mpg.key(MPG)
        peer.until("in control")
        assert mpg.line("$J=G91 X1 F600")[-1] == "ok"
        assert peer.idle_position_mm()[0] == 1.0
        mpg.key(MPG)
        peer.until("released")
        for line in ("$J=G91 X5 F600", "G0 X9", "$H", "G10 L20 P0 X0"):
            assert mpg.line(line)[-1] == BUSY, line
        peer.send("?")
        peer.until("^<Idle")
        assert place_mm(sender) == [1.0, 0.0, 0.0]
        assert sender.ask("G1 X20 F1200")[-1] == "ok"
        mpg.key(HOLD)
        peer.send("?")
        peer.until("^<Hold")
        mpg.key(RESUME)
        assert place_mm(sender)[0] == 20.0
        mpg.key(MPG)
        peer.until("in control")
        assert mpg.line("$J=G91 X1 F600")[-1] == "ok"


def test_what_an_mpg_has_queued_when_it_returns_control_is_not_done_later(serve: Serve) -> None:
    server = serve(speed=1.0, pendant=TCP, pendant_kind="mpg", settings=HOMES)
    with Peer.tcp(server.tcp or "") as sender, pendant_of(server) as peer:
        sender.ask("")
        mpg = FluidDial(peer)
        mpg.key(MPG)
        peer.until("in control")
        assert mpg.line(FAR_JOG)[-1] == "ok"
        peer.send(b"$J=G91 X300 F2000\n" * 3 + bytes([MPG]) + b"$J=G91 Y5 F2000\n")
        for _ in range(4):
            peer.until("^(ok|error)")
        stopped = place_mm(sender)
        assert stopped[0] < 399.0 and stopped[1] == 0.0
        assert sender.ask("G4 P0.2")[-1] == "ok"
        assert place_mm(sender) == stopped
