"""The ESP32's controller task as its network clients meet it: keys, floods, half-open and slow connections."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from esp32_serve import FINISH, HOLD, STOP, serving_esp32
from patience import HANG_S, wait_until

PLACES = 4
LOCKED = b"[MSG:Locked: log in at the web page, by wificnc login, or send $LOGIN=access key]\r\n"


class Client:
    """A connection, and what came over it."""

    def __init__(self, port: int, here: str = "127.0.0.1") -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), HANG_S, (here, 0))
        self.said = b""

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def until(self, wanted: bytes) -> bytes:
        """Everything up to and with this. Fails when the connection ends or nothing comes for ten seconds."""
        while wanted not in self.said:
            piece = self.socket.recv(65536)
            assert piece, f"closed after {self.said!r}"
            self.said += piece
        found, _, self.said = self.said.partition(wanted)
        return found + wanted

    def is_closed(self) -> bool:
        """Reads to the end."""
        try:
            while self.socket.recv(65536):
                pass
        except ConnectionError:
            pass
        return True


@contextmanager
def serving(key: str = "", sender_lost: str = FINISH) -> Iterator[Callable[..., Client]]:
    """A controller; gives a function that connects, from another loopback address where one is given."""
    clients: list[Client] = []
    with serving_esp32(key, sender_lost) as ports:

        def connect(here: str = "127.0.0.1") -> Client:
            clients.append(Client(ports.telnet, here))
            return clients[-1]

        try:
            yield connect
        finally:
            for client in clients:
                client.socket.close()


def fields(client: Client) -> list[str]:
    client.send(b"?")
    report = client.until(b">\r\n")
    return report[report.rindex(b"<") + 1 : report.rindex(b">")].decode().split("|")


def state(client: Client) -> str:
    return fields(client)[0]


def wait_for(client: Client, wanted: str) -> None:
    wait_until(lambda: state(client) == wanted, wanted)


def test_without_a_key_everybody_may_command() -> None:
    with serving() as connect:
        client = connect()
        client.send(b"G0X1\n")
        assert client.until(b"ok\r\n")


def test_a_stranger_sees_the_state_holds_and_commands_nothing() -> None:
    with serving("correct horse") as connect:
        stranger = connect()
        stranger.until(LOCKED)
        stranger.send(b"G0X100\n$J=G91X5F100\n$$\n\x18")
        assert state(stranger) == "Idle"
        friend = connect()
        friend.send(b"$LOGIN=correct horse\n$$\nG1X9000F60\n")
        friend.until(b"$110=")
        friend.until(b"ok\r\n")
        wait_for(stranger, "Run")
        stranger.send(b"\x18~\n")
        wait_for(stranger, "Run")
        stranger.send(b"!")
        wait_for(stranger, "Hold:0")
        stranger.send(b"~")
        assert state(stranger) == "Hold:0"
        assert b"$110" not in stranger.said and b"ok" not in stranger.said


def wificnc(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "wificnc", *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=HANG_S, stdin=subprocess.DEVNULL, check=False
    )


def test_our_own_commands_know_the_key() -> None:
    with serving("correct: horse/") as connect:
        host = f"127.0.0.1:{connect().socket.getpeername()[1]}"
        jog = ("jog", "X5", "--feed", "600", "--to")
        refused = wificnc(*jog, f"tcp://{host}")
        assert refused.returncode == 1 and "is locked" in refused.stderr
        wrong = wificnc(*jog, f"tcp://:horse@{host}")
        assert wrong.returncode == 1 and "refuses the access key" in wrong.stderr and "horse" not in wrong.stderr
        right = f"tcp://:correct%3A%20horse%2F@{host}"
        wait_until(lambda: wificnc("settings", "get", "--to", right).returncode == 0, "the right key works")
        assert wificnc("status", "--to", f"tcp://{host}").returncode == 0


def test_guessing_is_slowed_down_and_the_right_one_still_works() -> None:
    with serving("correct horse") as connect:
        guesser = connect()
        guesser.send(b"$LOGIN=a\n$LOGIN=b\n$LOGIN=correct horse\n")
        guesser.until(b"Wrong access key]")
        guesser.until(b"Wrong access key]")
        assert guesser.until(b"ok\r\n") == b"\r\nerror:180\r\nok\r\n"


def test_a_guesser_holds_up_its_own_address_and_nobody_elses() -> None:
    with serving("correct horse") as connect:
        guesser = connect("127.0.0.2")
        guesser.send(b"$LOGIN=a\n" * 9)
        guesser.until(b"Wrong access key]")
        client = connect("127.0.0.3")
        client.send(b"$LOGIN=correct horse\n")
        assert client.until(b"ok\r\n") == LOCKED + b"ok\r\n"
        assert b"Wrong access key" not in guesser.said, "its others wait"


def test_locked_clients_do_not_keep_others_out() -> None:
    with serving("correct horse") as connect:
        silent = [connect() for _ in range(PLACES + 6)]
        client = connect()
        client.send(b"$LOGIN=correct horse\n")
        client.until(b"ok\r\n")
        assert silent[0].is_closed()


def test_a_flood_is_answered_line_by_line_and_loses_nothing() -> None:
    lines = 3000
    with serving() as connect:
        client = connect()
        client.socket.setblocking(False)
        rest, answers = memoryview(b"G1X0F100\nG1Y0\n" * (lines // 2)), 0
        end = time.monotonic() + HANG_S
        while answers < lines:
            assert time.monotonic() < end, f"{answers} answers"
            with suppress(BlockingIOError):
                rest = rest[client.socket.send(rest) :] if rest else rest
            with suppress(BlockingIOError):
                answers += client.socket.recv(65536).count(b"ok\r\n")
        assert not rest


def test_who_does_not_read_is_dropped_and_harms_nobody() -> None:
    with serving() as connect:
        owner, slow = connect(), connect()
        owner.send(b"G0X0\n")
        owner.until(b"ok\r\n")
        for _ in range(12000):  # more than any kernel buffers
            owner.send(b"$$\n")
            owner.until(b"ok\r\n")
        assert slow.is_closed()


def test_half_open_connections_that_send_half_a_line_leave_no_trace() -> None:
    with serving() as connect:
        for _ in range(3 * PLACES):
            half = connect()
            half.send(b"G1X5000F60")
            half.socket.shutdown(socket.SHUT_WR)
            assert half.is_closed()
        client = connect()
        client.send(b"G0X1\n")
        client.until(b"ok\r\n")


@pytest.mark.parametrize(("sender_lost", "then"), [(FINISH, "Run"), (HOLD, "Hold:0"), (STOP, "Alarm")])
def test_when_the_sender_is_lost_the_setting_says_what_follows(sender_lost: str, then: str) -> None:
    with serving(sender_lost=sender_lost) as connect:
        owner, watcher = connect(), connect()
        owner.send(b"G1X9000F600\n")
        owner.until(b"ok\r\n")
        wait_for(watcher, "Run")
        while fields(watcher)[1].startswith("MPos:0.000,"):
            pass  # it is planned, and a move that has not begun can be forgotten
        owner.socket.close()
        wait_for(watcher, then)
        if sender_lost == FINISH:
            for _ in range(20):
                assert state(watcher) == "Run"


@pytest.mark.parametrize("sender_lost", [FINISH, HOLD, STOP])
def test_a_jog_ends_with_its_sender_whatever_the_setting(sender_lost: str) -> None:
    with serving(sender_lost=sender_lost) as connect:
        owner, watcher = connect(), connect()
        owner.send(b"$J=X9000F600\n")
        owner.until(b"ok\r\n")
        wait_for(watcher, "Jog")
        owner.socket.close()
        wait_for(watcher, "Idle")


def test_at_rest_a_lost_sender_changes_nothing() -> None:
    with serving(sender_lost=STOP) as connect:
        owner = connect()
        owner.send(b"G0X0\n")
        owner.until(b"ok\r\n")
        owner.socket.close()
        watcher = connect()
        wait_for(watcher, "Idle")
        watcher.send(b"G1X1F600\n")
        watcher.until(b"ok\r\n")
