"""Strangers who connect, say nothing, guess, or speak HTTP to the port of lines, over real sockets: no client shuts
the owner out, and nothing that they send is executed."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from esp32_serve import serving_esp32
from patience import wait_until
from slow import deep_but
from test_telnet import PLACES, Client, serving, state

STRANGER, OTHER = "127.0.0.66", "127.0.0.77"
OWNER = "127.0.0.2"
KEY = b"$LOGIN=correct horse\n"


def logs_in(client: Client) -> bool:
    client.send(KEY)
    client.until(b"ok\r\n")
    return True


@pytest.mark.parametrize("key", ["", "correct horse"])
def test_idle_connections_shut_nobody_out(key: str) -> None:
    with serving(key) as connect:
        idle = [connect(STRANGER) for _ in range(2 * PLACES)]
        owner = connect(OWNER)
        if key:
            logs_in(owner)
        owner.send(b"G0X1\n")
        owner.until(b"ok\r\n")
        assert idle[0].is_closed()


def test_who_says_nothing_is_told_and_disconnected() -> None:
    with serving() as connect:
        silent = connect(STRANGER)
        assert silent.until(b"]\r\n") == b"[MSG:Disconnected: nothing received for 10 s]\r\n"
        assert silent.is_closed()


def test_who_asks_for_reports_stays() -> None:
    with serving() as connect:
        watcher, silent = connect(OTHER), connect(STRANGER)
        while not silent.said:
            assert state(watcher) == "Idle"
            silent.socket.setblocking(False)
            with suppress(BlockingIOError):
                silent.said += silent.socket.recv(4096)
        assert state(watcher) == "Idle"


@contextmanager
def reconnecting(port: int, addresses: tuple[str, ...]) -> Iterator[list[int]]:
    """Threads that connect and ask for reports, in a loop. Gives how often each has come."""
    ending = threading.Event()
    rounds = [0] * len(addresses)

    def run(n: int) -> None:
        kept: list[socket.socket] = []
        while not ending.is_set():
            with suppress(OSError):
                kept.append(socket.create_connection(("127.0.0.1", port), 1, (addresses[n], 0)))
                kept[-1].sendall(b"?")
                rounds[n] += 1
            if len(kept) > PLACES:
                kept.pop(0).close()
        for one in kept:
            one.close()

    threads = [threading.Thread(target=run, args=(n,)) for n in range(len(addresses))]
    for thread in threads:
        thread.start()
    try:
        yield rounds
    finally:
        ending.set()
        for thread in threads:
            thread.join()


def rounds_more_than(rounds: list[int], before: list[int]) -> Callable[[], bool]:
    return lambda: all(now > then + PLACES for now, then in zip(rounds, before, strict=True))


def test_the_owner_comes_back_while_strangers_reconnect() -> None:
    with serving_esp32("correct horse") as ports:
        owner = Client(ports.telnet, OWNER)
        logs_in(owner)
        owner.send(b"G0X1\n")
        owner.until(b"ok\r\n")
        with reconnecting(ports.telnet, (STRANGER, OTHER)) as rounds:
            for _ in range(5):
                owner.socket.close()
                wait_until(rounds_more_than(rounds, list(rounds)), "strangers came")
                owner = Client(ports.telnet, OWNER)
                logs_in(owner)
                owner.send(b"G0X1\n")
                owner.until(b"ok\r\n")
        owner.socket.close()


def answer(client: Client) -> bytes:
    """The next line that is no report."""
    while (line := client.until(b"\r\n")).startswith(b"<"):
        pass
    return line


@pytest.mark.slow
@pytest.mark.parametrize("lines", deep_but((200).__eq__, [200, 700]))
def test_a_stream_loses_nothing_while_a_stranger_floods(lines: int) -> None:
    """200 connections that come and pour bytes: each line of the owner is answered once, in order, and run."""
    ending = threading.Event()
    with serving_esp32("correct horse") as ports:
        owner = Client(ports.telnet, OWNER)
        logs_in(owner)

        def flood() -> None:
            crowd: list[socket.socket] = []
            while not ending.is_set():
                with suppress(OSError):
                    one = socket.create_connection(("127.0.0.1", ports.telnet), 1, (STRANGER, 0))
                    one.setblocking(False)
                    crowd.append(one)
                for one in crowd:
                    with suppress(OSError):
                        one.send(b"$LOGIN=x\n?\x18G0X99\n")
                if len(crowd) > 200:
                    crowd.pop(0).close()
            for one in crowd:
                one.close()

        flooding = threading.Thread(target=flood)
        flooding.start()
        try:
            for n in range(lines):
                owner.send(b"G77\n" if n % 7 == 0 else b"G1X%dF9000\n" % (n % 3))
                assert answer(owner) == (b"error:20\r\n" if n % 7 == 0 else b"ok\r\n")
            owner.send(b"\x18")
            owner.until(b"Grbl ")
        finally:
            ending.set()
            flooding.join()
            owner.socket.close()


def test_a_right_key_is_accepted_while_others_at_its_address_guess() -> None:
    """As a page in the owner's browser would, or a stranger behind the same router."""
    with serving("correct horse") as connect:
        guesser = connect(OWNER)
        guesser.send(b"".join(b"$LOGIN=%d\n" % n for n in range(20)))
        guesser.until(b"Wrong access key]")
        owner = connect(OWNER)
        owner.send(KEY + b"G0X1\n")
        assert owner.until(b"ok\r\n").endswith(b"ok\r\n")
        owner.until(b"ok\r\n")


METHODS = ("GET", "POST", "PUT", "HEAD", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "MKCOL", "x-own", "get")


@pytest.mark.parametrize("method", METHODS)
def test_a_request_of_http_is_refused_and_nothing_in_it_is_executed(method: str) -> None:
    with serving() as connect:
        page = connect(STRANGER)
        body = b"\n$J=G91X50F600\nG0X5\n\x18!"
        target = b"[::1]:23" if method == "CONNECT" else b"/!~?G0X9"
        head = b"%s %s HTTP/1.1\r\nHost: 127.0.0.1:23\r\nContent-Length: %d\r\n\r\n"
        page.send(head % (method.encode(), target, len(body)) + body)
        assert page.until(b"\r\n") == b"HTTP/1.1 400 Bad Request\r\n"
        assert page.is_closed()
        watcher = connect()
        watcher.send(b"?")
        assert watcher.until(b">\r\n").startswith(b"<Idle|MPos:0.000,0.000")
        watcher.send(b"$J=G91X1F600\n")
        assert watcher.until(b"\r\n") == b"ok\r\n"


@pytest.mark.parametrize("hello", [b"\x16\x03\x01\x02\x00\x01", b"\x00\x01\x00\x00\x21\x12\xa4\x42!!!!"])
def test_tls_and_stun_are_refused(hello: bytes) -> None:
    """https:// in a browser, and what a page's WebRTC sends to a server of its choice."""
    with serving() as connect:
        page = connect(STRANGER)
        page.send(hello + b"\nG0X5\n!")
        assert page.is_closed()
        watcher = connect()
        assert state(watcher) == "Idle"


@pytest.mark.parametrize("line", ["GET/", "G 0 X 1", "posting", "G", "$G", "GETTING x", "x" * 60])
def test_lines_that_only_look_alike_are_answered(line: str) -> None:
    with serving() as connect:
        client = connect()
        for character in line + "\n":
            client.send(character.encode())
        assert b"ok" in (said := client.until(b"\r\n")) or b"error:" in said or b"[" in said
        client.send(b"G0X1\n")
        client.until(b"ok\r\n")


def test_a_line_is_not_held_up_by_the_look_at_its_begin() -> None:
    with serving() as connect:
        client = connect()
        client.send(b"?")
        assert client.until(b">\r\n").startswith(b"<Idle")
        client.send(b"G0X1\nGET / HTTP/1.1\n")
        client.until(b"ok\r\n")
        assert client.until(b"\r\n").startswith(b"error:")
