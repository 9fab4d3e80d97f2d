"""Several clients at one controller: who commands, who watches, and what happens when they come and go."""

from __future__ import annotations

import fcntl
import os
import socket
import struct
import termios
import threading
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from patience import HANG_S, wait_until
from serve_peer import Peer, Serve, connect, stream
from wificnc.simulator.serve.server import Server


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
        assert observer.line() == "error:181", "each line has one answer, so that no sender waits for ever"
        assert owner.idle_position_mm()[0] == 1.0


def test_observer_sees_answers_and_asks_for_reports(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        assert observer.status().startswith("<")


@pytest.mark.parametrize("byte", [b"\x18", b"\x85", b"~", b"\x9d"])
def test_observers_realtime_bytes_move_and_reset_nothing(server: Server, byte: bytes) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.send(byte)
        observer.status()
        assert owner.ask("G0X2") == ["ok"]
        owner.idle_position_mm()


def test_an_observer_holds_the_machine_and_then_resets_it(server: Server) -> None:
    """Any screen has a stop; a reset needs the hold first, because some senders reset whatever they connect to."""
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G1X500F60") == ["ok"]
        observer.send(b"!")
        wait_until(lambda: observer.status().startswith("<Hold:0"), "it stands")
        observer.send(b"~")
        assert observer.status().startswith("<Hold:0")
        observer.send(b"\x18")
        owner.until("Grbl ")


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
        first.idle_position_mm()  # what moves would be held
        assert second.ask("$take") == ["[MSG:In control]", "ok"]
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


BANNER_AFTER_S = 1.0  # targets/pc/serve.c


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


def test_a_pty_that_is_opened_prints_a_banner(serve: Serve) -> None:
    """As a board that its serial port resets: some senders wait for it before they say anything. Each time."""
    server = serve(pty=True)
    assert server.options.pty
    events = server.events()
    for _ in range(2):
        with Peer.serial(server.options.pty) as peer:
            peer.until(r"^Grbl 1\.1h \['\$' for help\]$")
            assert peer.ask("G21")[-1] == "ok"  # a move would be held as its sender leaves
        assert any(event.what == "disconnected" for event in events)


def test_who_speaks_first_gets_no_banner(serve: Serve) -> None:
    """It would read as a reset."""
    server = serve(pty=True)
    assert server.options.pty
    with Peer.serial(server.options.pty) as peer:
        assert peer.ask("G4P0") == ["ok"]
        began = time.monotonic()
        while time.monotonic() - began < 2 * BANNER_AFTER_S:
            peer.send("?")
            assert [line for line in peer.until("^<") if line.startswith("Grbl")] == []


def test_pty_and_tcp_share_the_controller(serve: Serve) -> None:
    server = serve(pty=True)
    assert server.options.pty
    with Peer.serial(server.options.pty) as serial, connect(server) as observer:
        assert serial.ask("G0X1")[-1] == "ok"
        assert observer.ask("$TAKE")[-1] == "ok"
        assert "[MSG:Observer: " + observer.name + " is in control, $TAKE takes control]" in serial.until("Observer")


STRANGER, OWNER = "127.0.0.66", "127.0.0.2"


def connect_from(server: Server, here: str) -> Peer:
    assert server.tcp
    host, _, port = server.tcp.rpartition(":")
    sock = socket.create_connection((host, int(port)), HANG_S, (here, 0))
    sock.setblocking(False)
    return Peer(sock.fileno(), sock)


def test_a_web_page_cannot_post_lines_to_the_port_of_senders(server: Server) -> None:
    """As fetch("http://127.0.0.1:2323/", {method: "POST", mode: "no-cors", body}) in any page of any site."""
    with connect(server) as browser:
        body = "\n$J=G91X10F600\nG0X5\n!"
        browser.send(f"POST / HTTP/1.1\r\nHost: 127.0.0.1:2323\r\nContent-Length: {len(body)}\r\n\r\n{body}")
        assert browser.until_closed()[0] == "HTTP/1.1 400 Bad Request"
    with connect(server) as sender:
        assert sender.status().startswith("<Idle|MPos:0.000,")
        assert sender.ask("G0X1") == ["ok"]
        assert sender.idle_position_mm()[0] == 1.0


def test_idle_strangers_shut_nobody_out(server: Server) -> None:
    with ExitStack() as stack:
        for _ in range(40):
            stack.enter_context(connect_from(server, STRANGER))
        owner = stack.enter_context(connect_from(server, OWNER))
        assert owner.ask("G0X1")[-1] == "ok"
        assert owner.idle_position_mm()[0] == 1.0  # a sender that is lost in motion would end in a hold
        for _ in range(40):
            stack.enter_context(connect_from(server, STRANGER))
        owner.close()
        owner = connect_from(server, OWNER)
        assert owner.ask("G0X2")[-1] == "ok"
        assert owner.idle_position_mm()[0] == 2.0
        owner.close()


def test_a_job_of_thousands_of_lines_while_strangers_reconnect(server: Server) -> None:
    """Every line is answered once, in order: errors where they belong."""
    lines = ["G77" if n % 11 == 0 else f"G1X{n % 5}F9000" for n in range(5000)]
    wanted = ["error:20" if n % 11 == 0 else "ok" for n in range(5000)]
    ending = threading.Event()

    def come_and_go() -> None:
        crowd: list[Peer] = []
        while not ending.is_set():
            with suppress(OSError):
                crowd.append(connect_from(server, STRANGER))
                crowd[-1].send_some(b"?G0X99\n\x18~")
            while len(crowd) > 200:
                crowd.pop(0).close()
        for one in crowd:
            one.close()

    with connect_from(server, OWNER) as owner:
        assert owner.ask("G0X0") == ["ok"]
        crowd = threading.Thread(target=come_and_go)
        crowd.start()
        try:
            assert stream(owner, lines) == wanted
        finally:
            ending.set()
            crowd.join()


def test_an_observer_has_automatic_reports_that_the_owner_does_not_get(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        observer.send("$RI=50\n")
        observer.until("^ok$")
        for _ in range(3):
            observer.until("^<")
        assert owner.ask("G4P0") == ["ok"], "no report came between"
