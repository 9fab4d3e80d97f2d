"""Time: the wall clock sets the pace, reports come immediately, and no one waits busily."""

from __future__ import annotations

import os
import select
import statistics
import time
from pathlib import Path

import pytest
from patience import waited_s
from serve_peer import Peer, Serve

ACCELERATION_MM_S2, SPEED_MM_S = 500.0, 50.0
TRIES = 20  # a busy computer is late now and then; a wrong pace is wrong each time
HERE = Path("/proc/thread-self")


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


@pytest.mark.skipif(not os.path.exists("/proc/self/schedstat"), reason="measures with /proc")
def test_reports_come_within_5_ms_under_load(serve: Serve) -> None:
    """The owner pours short segments, observers listen, the machine runs; and the owner asks."""
    server = serve(speed=1.0)
    assert server.tcp
    watchers = [Peer.tcp(server.tcp) for _ in range(3)]
    lines = b"".join(b"G1X%.2fY%.2fF3000\n" % (n % 40 * 0.05, n % 9 * 0.1) for n in range(3000))
    delays = []
    with Peer.tcp(server.tcp) as owner:
        owner.send(lines)
        for _ in range(300):
            threads = HERE, Path(f"/proc/{server.pid}")
            begin, waited = time.perf_counter(), waited_s(*threads)
            assert owner.status().startswith("<Run")
            delays.append(time.perf_counter() - begin - (waited_s(*threads) - waited))
            for watcher in watchers:
                watcher.hear()
    for watcher in watchers:
        watcher.close()
    delays.sort()
    # The last per cent belongs to the scheduler of a shared computer.
    assert delays[len(delays) * 99 // 100] < 0.005, statistics.quantiles(delays, n=20)


def work_seconds(pid: int) -> float:
    """Time on a processor, to the nanosecond, of a process that runs, too: not the time that it waited for one."""
    return time.clock_gettime(~pid << 3 | 2)  # clock_getcpuclockid() of Linux, which Python has for threads only


@pytest.mark.skipif(not os.path.exists("/proc/self/schedstat"), reason="Linux tells it there")
def test_reports_come_within_5_ms_at_full_speed(serve: Serve) -> None:
    """Long moves as fast as they go, and as much more of them as there is room for before each question."""
    server = serve(speed=0.0)
    assert server.tcp
    watchers = [Peer.tcp(server.tcp) for _ in range(4)]
    job = b"X1000\nX0\n" * 6500
    delays = []
    with Peer.tcp(server.tcp) as owner:
        owner.send_some(b"G90G1F60000\n" + job)
        while not owner.status().startswith("<Run"):
            pass
        for _ in range(100):
            owner.send_some(job)
            begin = work_seconds(server.pid)
            assert owner.status().startswith("<Run")
            delays.append(work_seconds(server.pid) - begin)
            for watcher in watchers:
                watcher.hear()
    for watcher in watchers:
        watcher.close()
    delays.sort()
    assert delays[95] < 0.005, delays[50:]


def test_a_real_time_byte_overtakes_all_that_was_poured(serve: Serve) -> None:
    """A whole file without counting, which takes a quarter of an hour to mill, and then the hold button."""
    server = serve(speed=1.0)
    assert server.tcp
    with Peer.tcp(server.tcp) as owner:
        owner.send(b"G91G1F600\n" + b"X0.05\nX-.05\n" * 90_000 + b"!")
        while not (report := owner.status()).startswith("<Hold:0"):
            assert report.startswith(("<Run", "<Hold:1")), report


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
        before = cpu_seconds(server.pid)
        assert select.select([peer], [], [], 2.0)[0] == [], "it speaks without being asked"
        assert cpu_seconds(server.pid) - before <= 0.04
