"""Clients that misbehave: the owner's job continues, and nothing is lost in silence."""

from __future__ import annotations

import select

import pytest
from serve_peer import Peer, Serve, connect, pour
from slow import deep_but
from wificnc.simulator.serve.server import Server

VARIANTS = ("release", "asan")
JOB = ["G21G90G1F3000", *(f"X{n % 40 * 0.05:.2f}Y{n % 9 * 0.1:.1f}" for n in range(1, 3001))]
JOB_END = [3000 % 40 * 0.05, 3000 % 9 * 0.1]


@pytest.fixture(params=deep_but("release".__eq__, VARIANTS))
def server(request: pytest.FixtureRequest, serve: Serve) -> Server:
    return serve(variant=request.param, pty=True)


def owns(owner: Peer) -> Peer:
    assert owner.ask("G0X0") == ["ok"]
    return owner


def run_job(owner: Peer) -> None:
    assert [answer for answer in pour(owner, JOB) if answer != "ok"] == []
    position = owner.idle_position_mm()
    assert position[:2] == pytest.approx(JOB_END, abs=0.0005)


def test_a_megabyte_without_a_line_end(server: Server) -> None:
    """One line, one answer."""
    with connect(server) as owner:
        owner.send(b"G0X1\n" + b"X" * 1_000_000 + b"\nG0X2\n")
        assert [owner.line() for _ in range(3)] == ["ok", "error:11", "ok"]
        assert owner.idle_position_mm()[0] == 2.0


def test_a_megabyte_of_an_observer(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        owns(owner)
        observer.send(b"X" * 1_000_000)
        run_job(owner)


def test_endless_line_ends_with_its_sender(server: Server) -> None:
    with connect(server) as watcher:
        with connect(server) as owner:
            owner.send(b"G0X1\n" + b"X" * 200_000)
            owner.until("^ok$")
        watcher.until("Incomplete line discarded")
        watcher.send("G0Y1\n")
        watcher.until("^ok$")
        assert watcher.idle_position_mm()[:2] == [1.0, 1.0]


def test_letters_of_utf8_are_text(server: Server) -> None:
    """In a comment they are nothing, in code an error; their bytes are no real-time commands."""
    with connect(server) as owner:
        owner.send("G0ä X5\nG0 X1 ; größer µm\nG0 (Übermaß) Y2\n".encode())
        assert [owner.line(), owner.line(), owner.line()] == ["error:1", "ok", "ok"]
        assert owner.idle_position_mm()[:2] == [1.0, 2.0]


def test_every_byte_there_is(server: Server) -> None:
    everything = bytes(byte for byte in range(256) if byte not in (0x18, ord("!"), ord("~"), 0x84, 0x85))
    with connect(server) as owner, connect(server) as other:
        owns(owner)
        other.send(everything * 50)
        owner.send(everything * 50 + b"\n")
        run_job_after_noise(owner)


def run_job_after_noise(owner: Peer) -> None:
    """The noise is answered in some way; then the job, which begins where the noise ends."""
    owner.send("\nG4P0.123\n")
    owner.send(b"\x18")
    owner.until("^Grbl ")
    owner.ask("$X")
    run_job(owner)


def test_connections_in_quick_succession(server: Server) -> None:
    """Far more than twenty a second, each with half a line, while the owner streams."""
    with connect(server) as owner:
        owns(owner)
        for _ in range(5):
            for _ in range(40):
                with connect(server) as visitor:
                    visitor.send("G0X")
            run_job(owner)


def test_owners_in_quick_succession(server: Server) -> None:
    """Each commands for the blink of an eye; whole lines are held, and the last one finds a sane controller."""
    for n in range(60):
        with connect(server) as owner:
            owner.send(f"G0Y{n % 5}\nG0X")
    with connect(server) as owner:
        owner.send("$TAKE\n~")
        owner.until("^ok$")
        run_job(owner)


def test_observer_that_does_not_read_is_dropped(server: Server) -> None:
    """Past what the system's buffers and its queue hold."""
    with connect(server) as owner, connect(server) as observer:
        owns(owner)
        assert pour(owner, ["$$"] * 16000) == ["ok"] * 16000
        observer.until_closed()
        run_job(owner)


def test_owner_that_does_not_read_loses_nothing(server: Server) -> None:
    """Its lines wait with the sender until it reads; then every answer is there."""
    lines = ["$$", "G77"] * 5000
    with connect(server) as owner:
        data = memoryview("".join(f"{line}\n" for line in lines).encode())
        looks = 0  # in a row that take nothing: half a second
        while data and looks < 5:
            taken = owner.send_some(bytes(data[:4096]))
            data = data[taken:]
            looks = 0 if taken else looks + 1
            if not taken:
                select.select([], [owner], [], 0.1)
        answers = []
        while len(answers) < len(lines):
            data = data[owner.send_some(bytes(data[:4096])) :]
            assert owner.hear()
            answers += [line for line in owner.heard() if line == "ok" or line.startswith("error:")]
        assert answers == ["ok", "error:20"] * 5000


def test_flood_of_status_requests(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        owns(owner)
        observer.send("?" * 100_000)
        run_job(owner)
        owner.send("?" * 100_000 + "\nG0X9\n")
        owner.until("^ok$")
        owner.until("^ok$")
        assert owner.idle_position_mm()[0] == 9.0


def test_pty_closed_in_the_middle(server: Server) -> None:
    link = server.options.pty
    assert link
    with connect(server) as watcher:
        for n in range(5):
            with Peer.serial(link) as serial:
                serial.send(f"~G0X{n + 1}\nG0Y")
                serial.until("^ok$")
            watcher.until("Incomplete line discarded")
        watcher.send("~G0Y3\n")
        watcher.until("^ok$")
        assert watcher.idle_position_mm()[:2] == [5.0, 3.0]
