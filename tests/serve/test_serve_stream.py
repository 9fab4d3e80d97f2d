"""Streams: every line answered once, in order, and every step where it belongs."""

from __future__ import annotations

import pytest
from serve_peer import Peer, Serve, pour, stream

LINES = 50_000
WRONG_EVERY = 997  # a prime: the errors fall on every kind of line


def program(count: int) -> tuple[list[str], list[str], list[float]]:
    """Short segments, a wrong line now and then: the lines, their answers, and where they end."""
    lines, answers = ["G21G90G94G1F3000"], ["ok"]
    x = y = 0.0
    for n in range(1, count):
        if n % WRONG_EVERY == 0:
            lines.append("G1X1X2")
            answers.append("error:25")
            continue
        x, y = (n * 7 % 50) / 50, (n * 3 % 20) / 25
        lines.append(f"X{x:.3f}Y{y:.3f}")
        answers.append("ok")
    return lines, answers, [x, y, 0.0]


@pytest.mark.parametrize("door", ["tcp", "pty"])
def test_poured_stream(serve: Serve, door: str) -> None:
    lines, answers, end = program(LINES)
    server = serve(pty=True)
    assert server.tcp and server.options.pty
    with Peer.tcp(server.tcp) if door == "tcp" else Peer.serial(server.options.pty) as peer:
        assert pour(peer, lines) == answers
        assert peer.idle_position_mm()[:3] == end


@pytest.mark.parametrize("in_flight", [20, 127, 1024])
def test_counted_stream(serve: Serve, in_flight: int) -> None:
    lines, answers, end = program(2000)
    server = serve(pty=True)
    assert server.options.pty
    with Peer.serial(server.options.pty) as peer:
        assert stream(peer, lines, in_flight) == answers
        assert peer.idle_position_mm()[:3] == end


@pytest.mark.parametrize("line_end", ["\n", "\r", "\r\n"])
def test_line_ends(serve: Serve, line_end: str) -> None:
    server = serve()
    assert server.tcp
    with Peer.tcp(server.tcp) as peer:
        peer.send(line_end.join(["G0X1", "", "G0X2", "G99", ""]))
        assert [peer.line() for _ in range(4)] == ["ok", "ok", "ok", "error:20"]
        assert peer.idle_position_mm()[0] == 2.0


def test_short_segments_are_never_starved(serve: Serve) -> None:
    """1000 blocks a second in real time, and the machine keeps its speed: 0.05 mm each at 3000 mm/min."""
    server = serve(speed=1.0)
    assert server.tcp
    lines = ["G21G90G1F3000", *(f"X{n * 0.05:.2f}" for n in range(1, 2001))]
    with Peer.tcp(server.tcp) as peer, Peer.tcp(server.tcp) as watcher:
        peer.send("".join(f"{line}\n" for line in lines))
        assert [peer.line() for _ in range(200)] == ["ok"] * 200
        reports = [watcher.status()]
        while reports[-1].startswith("<Run"):
            reports.append(watcher.status())
        speeds = [int(report.split("FS:")[1].split(",")[0]) for report in reports]
        assert len(reports) > 20
        assert speeds[:20] == [3000] * 20, reports
        assert peer.idle_position_mm()[0] == 100.0
