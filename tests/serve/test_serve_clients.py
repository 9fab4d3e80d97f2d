"""Several clients at one controller: who commands, who watches, and what happens when they come and go."""

from __future__ import annotations

import fcntl
import os
import struct
import termios
from contextlib import suppress
from pathlib import Path

import pytest
from serve_peer import Peer, Serve, connect
from wificnc.serve.server import Server


@pytest.fixture
def server(serve: Serve) -> Server:
    return serve()


def test_second_client_is_told_who_commands(server: Server) -> None:
    with connect(server) as owner:
        assert owner.ask("G0X1") == ["ok"]
        with connect(server) as observer:
            assert observer.line() == f"[MSG:Observer: {owner.name} is in control, $TAKE takes control]"


def test_observers_line_is_explained_and_not_run(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        observer.send("G0X5\n")
        assert observer.until(r"^\[MSG:Observer")[-1].endswith("$TAKE takes control]")
        assert owner.idle_position_mm()[0] == 1.0


def test_observer_sees_answers_and_asks_for_reports(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        assert observer.status().startswith("<")


@pytest.mark.parametrize("byte", [b"!", b"\x18", b"\x85", b"~"])
def test_observers_realtime_bytes_do_nothing(server: Server, byte: bytes) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.send(byte)
        observer.status()
        assert owner.ask("G0X2") == ["ok"]
        owner.idle_position_mm()


def test_next_client_may_take_over_when_the_owner_leaves(server: Server) -> None:
    with connect(server) as observer:
        with connect(server) as owner:
            assert owner.ask("G0X1") == ["ok"]
            owner.idle_position_mm()
        assert (
            observer.until("No client is in control")[-1]
            == "[MSG:No client is in control: the first line takes control]"
        )
        assert observer.ask("G0X2")[-1] == "ok"
        assert observer.idle_position_mm()[0] == 2.0


def test_take_moves_ownership_and_is_answered_once(server: Server) -> None:
    with connect(server) as first, connect(server) as second:
        assert first.ask("G0X1") == ["ok"]
        second.until("^ok$")
        assert second.ask("$take") == ["ok"]
        assert first.until("Observer")[-1] == f"[MSG:Observer: {second.name} is in control, $TAKE takes control]"
        assert second.ask("G0X7") == ["ok"]
        assert second.ask("$TAKE") == ["ok"]
        assert second.idle_position_mm()[0] == 7.0


def test_answers_of_a_job_left_behind(server: Server) -> None:
    with connect(server) as observer:
        with connect(server) as owner:
            owner.send("M0\nG77\nG0X3\n")
            observer.until(r"commands\]$")
            observer.send("?")
            observer.until("^<Hold")
        observer.until("No client is in control")
        observer.send("~$X\n")
        assert observer.until("^ok$")[-1] == "ok"
        assert observer.idle_position_mm()[0] == 3.0


def test_half_line_of_a_vanished_owner_is_dropped_and_its_job_waits(server: Server) -> None:
    with connect(server) as observer:
        with connect(server) as owner:
            owner.send("G0X1\nG0X2\nG0X3")
        said = observer.until("No client is in control")
        assert "[MSG:Incomplete line discarded: the sender disconnected]" in said
        observer.send("~")
        assert observer.ask("Y1")[-1] == "ok"
        assert observer.idle_position_mm()[:2] == [2.0, 1.0]


def test_half_line_of_an_observer_is_not_the_begin_of_an_owners(server: Server) -> None:
    with connect(server) as late:
        with connect(server) as owner:
            assert owner.ask("G0X1") == ["ok"]
            late.send("G0X")
            late.status()
        late.until("No client is in control")
        late.send("9\nG0X2\n")
        late.until("^ok$")
        assert late.idle_position_mm()[0] == 2.0


def test_sender_that_closes_its_half_hears_all_answers(server: Server) -> None:
    with connect(server) as peer:
        peer.send("G0X1\nG77\nG4P0.01\nG0X2\n")
        peer.send_end()
        assert [line for line in peer.until_closed() if not line.startswith("[")] == ["ok", "error:20", "ok", "ok"]


def test_reset_forgets_lines_that_wait(server: Server) -> None:
    with connect(server) as peer:
        peer.send("M0\n" + "G0X5\n" * 2000)
        peer.send("?")
        peer.until("^<Hold")
        peer.send(b"\x18")
        peer.until("^Grbl ")
        assert peer.ask("G0X1") == ["ok"]
        assert peer.idle_position_mm()[0] == 1.0


def test_telnet_negotiation_is_refused_and_leaves_no_trace(server: Server) -> None:
    will_naws, do_echo, window = b"\xff\xfb\x1f", b"\xff\xfd\x01", b"\xff\xfa\x1f\x00\x50\xff\xff\x00\x18\xff\xf0"
    with connect(server) as peer:
        peer.send(b"G0" + will_naws + b"X" + window + b"2" + do_echo + b"\xff\xf1\r\n")
        assert peer.line().encode("latin-1") == b"\xff\xfe\x1f\xff\xfc\x01ok"
        assert peer.idle_position_mm()[0] == 2.0


def test_seventeenth_client_is_refused_in_words(server: Server) -> None:
    peers = []
    for _ in range(16):
        peers.append(connect(server))
        peers[-1].status()
    with connect(server) as one_more:
        assert one_more.until_closed() == ["[MSG:Connection refused: all client slots are in use]"]
    peers.pop().close()
    assert peers[0].ask("G0X1") == ["ok"]
    for peer in peers:
        peer.close()


def toggle_dtr(link: Path) -> None:
    """As a sender does on opening; a pty has no such line and may refuse."""
    fd = os.open(link, os.O_RDWR | os.O_NOCTTY)
    for request in (termios.TIOCMBIC, termios.TIOCMBIS):
        with suppress(OSError):
            fcntl.ioctl(fd, request, struct.pack("I", termios.TIOCM_DTR))
    os.close(fd)


def test_pty_is_opened_again_and_again(serve: Serve) -> None:
    """Opening toggles DTR: a pty must survive DTR ioctls and reopening. Each opening begins fresh."""
    server = serve(pty=True)
    link = server.options.pty
    assert link
    events = server.events()
    for n in range(5):
        with Peer.serial(link) as peer:
            toggle_dtr(link)
            assert peer.ask(f"G0X{n}") == ["ok"]
            peer.idle_position_mm()
            peer.send("?$$\n")
        assert any(event.what == "disconnected" for event in events)
    assert os.readlink(link) == str(server.device)


def test_pty_and_tcp_share_the_controller(serve: Serve) -> None:
    server = serve(pty=True)
    assert server.options.pty
    with Peer.serial(server.options.pty) as serial, connect(server) as observer:
        assert serial.ask("G0X1")[-1] == "ok"
        assert observer.ask("$TAKE")[-1] == "ok"
        assert "[MSG:Observer: " + observer.name + " is in control, $TAKE takes control]" in serial.until("Observer")
