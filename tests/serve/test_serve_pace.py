"""Time: the wall clock sets the pace, reports come immediately, and no one waits busily."""

from __future__ import annotations

import os
import select
import signal
import time
from pathlib import Path

import pytest
from serve_peer import Peer, Serve

ACCELERATION_MM_S2, SPEED_MM_S = 500.0, 50.0
STEPS_PER_MM = 250  # of the host board
PIECE_BYTES, PIECE_STEPS = 1024, 200  # what is read in one step, and the steps that may follow it
REST_S = 0.025  # a sleep at rest
TRIES = 20  # a busy computer is late now and then; a wrong pace is wrong each time


def move_seconds(mm: float) -> float:
    """A move from rest to rest."""
    return mm / SPEED_MM_S + SPEED_MM_S / ACCELERATION_MM_S2


def timed_move(peer: Peer, mm: float) -> float:
    """G4P0 is answered when the move before it has come to rest."""
    begin = time.monotonic()
    peer.send(f"G91G1F{60 * SPEED_MM_S:.0f}X{mm}\nG4P0\n")
    peer.until("^ok$")
    peer.until("^ok$")
    return time.monotonic() - begin


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "mm"), [(1.0, 50.0), (10.0, 500.0), (0.5, 20.0)])
def test_moves_take_their_time(serve: Serve, speed: float, mm: float) -> None:
    server = serve(speed=speed)
    assert server.tcp
    with Peer.tcp(server.tcp) as peer:
        for _ in range(TRIES):
            late_s = timed_move(peer, mm) - move_seconds(mm) / speed
            assert late_s > -0.05, "too early"
            if late_s < 0.15:
                return
        raise AssertionError(f"{late_s:.2f} s late, as each time before")


def test_no_clock_at_full_speed(serve: Serve) -> None:
    server = serve(speed=0.0)
    assert server.tcp
    with Peer.tcp(server.tcp) as peer:
        assert timed_move(peer, 20_000.0) < move_seconds(20_000.0) / 4


def stop(pid: int) -> None:
    """The whole program pauses: what is sent now is there when it continues."""
    os.kill(pid, signal.SIGSTOP)
    while Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "T":
        os.sched_yield()


@pytest.mark.skipif(not hasattr(os, "sched_yield"), reason="stops a program, as Linux can")
@pytest.mark.parametrize("speed", [1.0, 0.0])
def test_a_question_waits_for_a_short_round_a_piece(serve: Serve, speed: float) -> None:
    """Behind a job of 57 pieces: each may bring one line and one short round of steps, whatever the computer does.
    `make bench-serve` measures the time that this takes."""
    server = serve(speed=speed)
    assert server.tcp
    job = b"X1000\nX0\n" * 6500
    with Peer.tcp(server.tcp) as owner:
        owner.send(b"G90G1F60000\n" + job)
        for _ in range(10):
            while not owner.status().startswith("<Run"):
                pass
            owner.send("!")
            while not (held := owner.status()).startswith("<Hold:0"):
                pass
            stop(server.pid)
            owner.hear()
            owner.heard()
            owner.send("~")
            pieces = owner.send_some(job) // PIECE_BYTES + 2
            owner.send("?")
            os.kill(server.pid, signal.SIGCONT)
            *answers, report = owner.until("^<")
            assert pieces > 4 and len(answers) <= pieces
            if speed == 0.0:
                assert 0 < abs(x_mm(report) - x_mm(held)) * STEPS_PER_MM <= pieces * PIECE_STEPS


def x_mm(report: str) -> float:
    return float(report.split("MPos:")[1].split(",")[0])


def test_a_real_time_byte_overtakes_all_that_was_poured(serve: Serve) -> None:
    """A whole file without counting, which takes a quarter of an hour to mill, and then the hold button."""
    server = serve(speed=1.0)
    assert server.tcp
    with Peer.tcp(server.tcp) as owner:
        owner.send(b"G91G1F600\n" + b"X0.05\nX-.05\n" * 90_000 + b"!")
        while not (report := owner.status()).startswith("<Hold:0"):
            assert report.startswith(("<Run", "<Hold:1")), report


def sleeps(pid: int) -> int:
    """How often the program has gone to sleep of itself."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.split("\nvoluntary_ctxt_switches:")[1].split()[0])


def cpu_seconds(pid: int) -> float:
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="measures with /proc")
@pytest.mark.parametrize("speed", [1.0, 0.0])
def test_at_rest_it_sleeps(serve: Serve, speed: float) -> None:
    server = serve(speed=speed, pty=True)
    assert server.tcp
    with Peer.tcp(server.tcp) as peer:
        assert peer.ask("G0X1") == ["ok"]
        peer.idle_position_mm()
        peer.hear()
        begin, worked, slept = time.monotonic(), cpu_seconds(server.pid), sleeps(server.pid)
        assert select.select([peer], [], [], 2.0)[0] == [], "it speaks without being asked"
        sleeps_now, worked_now, end = sleeps(server.pid), cpu_seconds(server.pid), time.monotonic()
        assert sleeps_now - slept <= (end - begin) / REST_S + 5
        assert worked_now - worked <= (end - begin) / 4, "it waits busily"
