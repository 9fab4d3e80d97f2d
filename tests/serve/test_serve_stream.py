"""Streams: every line answered once, in order, and every step where it belongs."""

from __future__ import annotations

import pytest
from bench.streams import Door, StreamError, pour, program, rest_mm
from serve_peer import Peer, Serve, stream

LINES = 50_000  # a million: make stream-million


@pytest.mark.parametrize("kind", ["tcp", "pty"])
def test_poured_stream(serve: Serve, kind: str) -> None:
    job = program(LINES)
    server = serve(pty=True)
    assert server.tcp and server.options.pty
    with Door(server.tcp if kind == "tcp" else server.options.pty) as door:
        pour(door, job.lines, job.answers)
        assert rest_mm(door) == job.end_mm()


def test_a_wrong_answer_is_seen(serve: Serve) -> None:
    job = program(2000)
    server = serve()
    assert server.tcp
    with Door(server.tcp) as door, pytest.raises(StreamError, match="answer 998 is error:25, to G1X1X2"):
        pour(door, job.lines, ["ok"] * len(job.lines))


@pytest.mark.parametrize("in_flight", [40, 127, 1024, 2048])
def test_counted_stream(serve: Serve, in_flight: int) -> None:
    job = program(2000)
    server = serve(pty=True)
    assert server.options.pty
    with Peer.serial(server.options.pty) as peer:
        assert stream(peer, job.lines, in_flight) == list(job.answers)
        assert tuple(peer.idle_position_mm()[:3]) == job.end_mm()


@pytest.mark.parametrize("line_end", ["\n", "\r", "\r\n"])
def test_line_ends(serve: Serve, line_end: str) -> None:
    server = serve()
    assert server.tcp
    with Peer.tcp(server.tcp) as peer:
        peer.send(line_end.join(["G0X1", "", "G0X2", "G77", ""]))
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
        begin = speeds.index(3000)
        assert len(reports) > begin + 20
        assert speeds[begin : begin + 20] == [3000] * 20, reports
        assert peer.idle_position_mm()[0] == 100.0
