"""Senders that vanish, over real sockets and a pty: by closing, by dying, with others connected or none."""

from __future__ import annotations

import re
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import HANG_S, wait_until
from serve_peer import SLOW, Peer, Serve, clock, connect, serial
from wificnc.simulator.serve.server import Server

LOST = "[MSG:Sender lost: feed hold]"
CUT = "M3S500\nG91G1X-300F3000\n"  # six seconds
SPEED = 4.0  # of virtual time, so that spindles run up in a second


def abort(peer: Peer) -> None:
    """RST instead of FIN, as from a machine that was switched off and on."""
    assert peer._sock
    peer._sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()


def wait_for(peer: Peer, state: str) -> str:
    report = ""

    def is_there() -> bool:
        nonlocal report
        report = peer.status()
        return report.startswith(f"<{state}")

    wait_until(is_there, lambda: report)
    return report


def x_of(report: str) -> float:
    found = re.search(r"MPos:(-?[\d.]+)", report)
    assert found, report
    return float(found[1])


def moving(peer: Peer) -> None:
    while x_of(peer.status()) == 0.0:
        pass


CASES = [
    pytest.param(connect, Peer.close, id="tcp closed"),
    pytest.param(connect, abort, id="tcp aborted"),
    pytest.param(serial, Peer.close, id="pty closed"),
]
Open = Callable[[Server], Peer]
End = Callable[[Peer], None]


@pytest.mark.parametrize(("open_", "end"), CASES)
def test_a_jog_ends(serve: Serve, open_: Open, end: End) -> None:
    server = serve(speed=SPEED, pty=True)
    owner = open_(server)
    assert owner.ask("$J=G91X-4000F3000") == ["ok"]
    moving(owner)
    end(owner)
    with connect(server) as late:
        assert -3900 < x_of(wait_for(late, "Idle")) < 0
        assert not any("lost" in line for line in late.heard())


@pytest.mark.parametrize(("open_", "end"), CASES)
def test_a_program_is_held_and_the_next_client_is_told(serve: Serve, open_: Open, end: End) -> None:
    server = serve(speed=SLOW, pty=True, control=0)
    owner = open_(server)
    owner.send(CUT)
    owner.until("^ok$")
    owner.until("^ok$")
    moving(owner)
    end(owner)
    with connect(server) as late:
        late.until("Sender lost")
        clock(server, SPEED)
        held = x_of(wait_for(late, "Hold:0"))
        assert -300 < held < 0
    with connect(server) as later:
        assert later.line() == LOST
        assert x_of(wait_for(later, "Hold:0")) == held
        later.send("~")
        assert x_of(wait_for(later, "Idle")) == -300.0
        later.send("\x18")


def test_a_watcher_hears_it_and_takes_over(serve: Serve) -> None:
    """A second client is no sender: with the owner gone the program is held, and whoever speaks first commands."""
    server = serve(speed=SLOW, control=0)
    with connect(server) as watcher:
        with connect(server) as owner:
            owner.send(CUT)
            moving(owner)
        assert LOST in watcher.until("Sender lost")
        assert -300 < x_of(watcher.status()) < 0
        clock(server, SPEED)
        wait_for(watcher, "Hold:0")
        watcher.send("~")
        assert x_of(wait_for(watcher, "Idle")) == -300.0


def test_a_watcher_that_leaves_stops_nothing(serve: Serve) -> None:
    server = serve(speed=SLOW, control=0)
    with connect(server) as owner:
        with connect(server) as watcher:
            owner.send(CUT)
            moving(owner)
            watcher.status()
        clock(server, SPEED)
        wait_for(owner, "Idle")
        assert owner.idle_position_mm()[0] == -300.0


def test_a_former_owner_that_leaves_stops_nothing(serve: Serve) -> None:
    """Who took over answers for what is held then."""
    server = serve(speed=SLOW, control=0)
    with connect(server) as new:
        with connect(server) as old:
            old.send(CUT)
            moving(old)
            new.send("$TAKE\n")
            assert new.name in old.until("Observer")[-1]
        clock(server, SPEED)
        new.send("~")
        assert x_of(wait_for(new, "Idle")) == -300.0


def test_a_jog_ends_when_another_client_takes_control(serve: Serve) -> None:
    """As a jog of WMC3: who has the key down can no longer repeat it, and the new owner did not start it."""
    server = serve(speed=SLOW, control=0)
    with connect(server) as old, connect(server) as new:
        old.send("$J=G91X-300F3000\n$J=G91X-300F3000\n")
        wait_for(old, "Jog")
        new.send("$TAKE\n")
        assert new.name in old.until("Observer")[-1]
        clock(server, SPEED)
        assert x_of(wait_for(new, "Idle")) > -300.0
        assert new.ask("G91G1X-1F3000")[-1] == "ok", "nothing is held"


def test_a_sender_that_only_ends_its_input_is_no_lost_one(serve: Serve) -> None:
    """`nc` closes its half and listens: everything runs to its end, and the connection lasts as long."""
    server = serve(speed=SPEED)
    with connect(server) as peer:
        peer.send("G91G1X-20F3000\nX-20\nG77\n")
        peer.send_end()
        said = peer.until_closed()
        assert [line for line in said if not line.startswith("[MSG")] == ["ok", "ok", "error:20"]
    with connect(server) as late:
        assert late.idle_position_mm()[0] == -40.0


def test_its_spindle_stops_when_all_is_done(serve: Serve) -> None:
    server = serve(speed=SPEED)
    with connect(server) as peer:
        peer.send("M3S500\nG91G1X-5F3000\n")
        peer.send_end()
        peer.until_closed()
    with connect(server) as late:
        assert late.line() == LOST
        assert x_of(wait_for(late, "Hold:0")) == -5.0


def test_lines_of_a_lost_sender_wait(serve: Serve) -> None:
    """More lines than the controller holds, and the sender dies: none runs before `~`; a reset forgets them."""
    server = serve(speed=SPEED)
    owner = connect(server)
    owner.send("G91\n" + "G1X-1F3000\n" * 3000)
    owner.until("^ok$")
    moving(owner)
    abort(owner)
    with connect(server) as late:
        held = x_of(wait_for(late, "Hold:0"))
        time.sleep(0.1)
        assert x_of(late.status()) == held
        late.send("\x18")
        late.until("^Grbl")
        assert late.ask("$G")[-1] == "ok"
        assert x_of(wait_for(late, "Idle")) == held


def test_wificnc_send_that_is_killed(serve: Serve, tmp_path: Path) -> None:
    server = serve(speed=SPEED)
    job = tmp_path / "job.nc"
    job.write_text("M3 S500\nG91\n" + "G1 X-1 F3000\nG1 X1\n" * 400)
    sender = subprocess.Popen(
        [sys.executable, "-m", "wificnc", "send", str(job), "--to", f"tcp://{server.tcp}"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    with connect(server) as watcher:
        wait_for(watcher, "Run")
        sender.send_signal(signal.SIGKILL)
        sender.wait(HANG_S)
        watcher.until("Sender lost")
        wait_for(watcher, "Hold:0")


def test_clients_that_ask_and_go_leave_nothing(serve: Serve) -> None:
    server = serve(speed=SPEED)
    for _ in range(5):
        with connect(server) as peer:
            assert peer.ask("$$")[-1] == "ok"
    with connect(server) as late:
        assert wait_for(late, "Idle")
        assert not any("lost" in line for line in late.heard())
