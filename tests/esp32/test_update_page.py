"""Updates through the page: the firmware's own server and receiver, and a slot that is a file."""

from __future__ import annotations

import hashlib
import http.client
import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from chip import image
from patience import HANG_S, wait_until
from update_page import SLOT_SIZE, Receiver, receiver
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin
from wificnc.build.signing import raw_signature, signing_key
from wificnc.firmware.flash.ota import Hello, proof

KEY = "correct horse"
GOOD = image("esp32s3", 150_000)
OLD = "0ld0ld0ld0ld0ld0"  # as update_serve.c has it


@pytest.fixture
def there(tmp_path: Path) -> Iterator[Receiver]:
    with receiver(KEY, tmp_path / "slot.bin") as running:
        yield running


class Page:
    """What the page does at /update."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self._said = b""
        words = self.line().split()
        assert words[:2] == ["WIFICNC-OTA", "3"]
        self.hello = Hello(words[2], words[3], words[4], int(words[5]), words[6], words[7] == "trial")

    def line(self) -> str:
        while b"\n" not in self._said:
            said = self.socket.recv(HANG_S)
            assert isinstance(said, bytes)
            self._said += said
        line, _, self._said = self._said.partition(b"\n")
        return line.decode()

    def ask(self, data: bytes, key: str = KEY, signature: bytes | None = None) -> str:
        """The request; @return its answer"""
        signed = raw_signature(signing_key().sign(data) or b"") if signature is None else signature
        request = f"{len(data)} {hashlib.sha256(data).hexdigest()} {signed.hex()}"
        self.socket.send(f"{request} {proof(key, self.hello, request)}\n".encode())
        return self.line()

    def confirm(self, key: str) -> str:
        self.socket.send(f"confirm {proof(key, self.hello, 'confirm')}\n".encode())
        return self.line()

    def send(self, data: bytes) -> list[str]:
        """The image; @return what it says until it ends"""
        for at in range(0, len(data), 16384):
            self.socket.send(data[at : at + 16384])
        said = [self.line()]
        while said[-1].startswith("AT "):
            said.append(self.line())
        return said


@contextmanager
def opened(there: Receiver, origin: str = "") -> Iterator[Page]:
    own = f"http://127.0.0.1:{there.page}"
    with connect(f"ws://127.0.0.1:{there.page}/update", origin=Origin(origin or own), open_timeout=HANG_S) as one:
        yield Page(one)


def answer(there: Receiver, data: bytes, key: str = KEY, signature: bytes | None = None) -> str:
    """To the request alone."""
    with opened(there) as page:
        return page.ask(data, key, signature)


def test_an_update_arrives_whole_and_tells_how_far_it_is(there: Receiver) -> None:
    with opened(there) as page:
        assert page.hello.board == "esp32s3-devkitc"
        assert page.ask(GOOD) == "OK"
        *progress, last = page.send(GOOD)
    at = [int(line.removeprefix("AT ")) for line in progress]
    assert last == "DONE" and at == sorted(at) and len(at) == 2 and 0 < at[0] <= at[-1] <= len(GOOD)
    assert there.slot.read_bytes() == GOOD


DAMAGED = GOOD[:100_000] + bytes([GOOD[100_000] ^ 1]) + GOOD[100_001:]


@pytest.mark.parametrize(
    ("data", "sent", "why"),
    [
        (GOOD, DAMAGED, "damaged"),
        (image("esp32", 150_000), None, "another chip"),
        (image("esp32s3", 150_000, project=b"other"), None, "another product"),
        (image("esp32s3", SLOT_SIZE + 1), None, "larger than its slot"),
        (b"\x7fELF" + bytes(150_000), None, "not an ESP32 firmware image"),
        (b"short", None, "too small"),
    ],
)
def test_what_is_no_firmware_for_it_is_refused_with_the_reason(
    there: Receiver, data: bytes, sent: bytes | None, why: str
) -> None:
    with opened(there) as page:
        said = page.ask(data)
        if said == "OK":
            said = page.send(sent or data)[-1]
    assert said.startswith("ERROR ") and why in said
    wait_until(lambda: not there.slot.exists(), "the slot is given up")


def test_neither_another_signature_nor_another_key_is_accepted(there: Receiver) -> None:
    other = raw_signature(signing_key().sign(DAMAGED) or b"")
    assert "not signed" in answer(there, GOOD, signature=other)
    assert "wrong access key" in answer(there, GOOD, key="wrong horse")
    assert not there.slot.exists()


def test_a_page_from_elsewhere_gets_no_stream(there: Receiver) -> None:
    with pytest.raises(InvalidStatus) as refused, opened(there, "http://evil.example"):
        pass
    assert refused.value.response.status_code == 403
    connection = http.client.HTTPConnection("127.0.0.1", there.page, timeout=HANG_S)
    connection.request("GET", "/update")
    assert connection.getresponse().status == 426
    connection.close()


def sender(there: Receiver) -> socket.socket:
    """Logged in."""
    one = socket.create_connection(("127.0.0.1", there.telnet), HANG_S)
    one.sendall(f"$LOGIN={KEY}\n".encode())
    return one


def until(one: socket.socket, what: bytes) -> None:
    said = b""
    while what not in said:
        piece = one.recv(4096)
        assert piece, said
        said += piece


@pytest.mark.parametrize(
    ("lines", "state"),
    [
        (b"G91\nG1X1000F60\n", b"<Run"),
        (b"G91\nG1X1000F60\n!", b"<Hold:0"),
        (b"$J=G91X1000F60\n", b"<Jog"),
        (b"M0\n", b"<Hold:0"),
        (b"G4P1000\n", b"<"),
    ],
)
def test_no_update_begins_while_a_job_runs_or_is_held(there: Receiver, lines: bytes, state: bytes) -> None:
    with sender(there) as one:
        until(one, b"ok\r\n")
        one.sendall(lines)
        until_state(one, state)
        said = answer(there, GOOD)
        assert "ERROR a job is running or held: " in said and not there.slot.exists()
        one.sendall(b"\x18")
        until(one, b"Grbl ")
    assert answer(there, GOOD) == "OK"  # and it is neither locked nor occupied


def until_state(one: socket.socket, state: bytes) -> None:
    said = b""
    while state not in said:
        one.sendall(b"?")
        piece = one.recv(4096)
        assert piece, said
        said += piece


def test_a_lost_connection_leaves_nothing_behind(there: Receiver) -> None:
    with opened(there) as page:
        assert page.ask(GOOD) == "OK"
        page.socket.send(GOOD[:50_000])
    wait_until(lambda: not there.slot.exists(), "the slot is given up")
    with opened(there) as again:
        assert again.ask(GOOD) == "OK" and again.send(GOOD)[-1] == "DONE"


def test_only_one_upload_at_a_time(there: Receiver) -> None:
    with opened(there) as page:
        assert page.ask(GOOD) == "OK"
        with connect(f"ws://127.0.0.1:{there.page}/update", open_timeout=HANG_S) as second:
            assert second.recv(HANG_S) == b"ERROR another upload is in progress\n"
        assert page.send(GOOD)[-1] == "DONE"


def test_who_only_looks_has_not_reached_the_new_firmware(there: Receiver) -> None:
    """The trial of a new firmware: only who may command could send the next one."""
    assert not there.is_reached()
    with socket.create_connection(("127.0.0.1", there.telnet), HANG_S) as one:
        one.sendall(b"?")
        until(one, b"<")
        assert not there.is_reached()
        one.sendall(f"$LOGIN={KEY}\n".encode())
        until(one, b"ok\r\n")
        assert there.is_reached()
    wait_until(lambda: not there.is_reached(), "the connection has ended")


def test_it_says_which_firmware_runs_and_whether_it_is_kept(there: Receiver) -> None:
    """Of the old one, and of the new one, which a proof of the key confirms."""
    with opened(there) as page:
        assert page.hello.digest == OLD and not page.hello.on_trial
        assert page.ask(GOOD) == "OK" and page.send(GOOD)[-1] == "DONE"
    wait_until(lambda: hello_of(there).on_trial, "the new firmware runs")
    assert hello_of(there).digest == GOOD[176:184].hex() != OLD
    with opened(there) as page:
        assert page.confirm("wrong horse") == "ERROR wrong access key"
    assert hello_of(there).on_trial
    with opened(there) as page:
        assert page.confirm(KEY) == "OK"
    wait_until(lambda: not hello_of(there).on_trial, "it is kept")


def hello_of(there: Receiver) -> Hello:
    with opened(there) as page:
        return page.hello


def test_the_digest_is_in_what_the_page_and_a_terminal_ask(there: Receiver) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", there.page, timeout=HANG_S)
    connection.request("GET", "/api/controller")
    assert json.loads(connection.getresponse().read())["digest"] == OLD
    connection.close()
    with socket.create_connection(("127.0.0.1", there.telnet), HANG_S) as one:
        one.sendall(f"$LOGIN={KEY}\n$I\n".encode())
        until(one, f"[DIGEST:{OLD}]\r\n".encode())


def test_during_an_update_the_machine_says_so(there: Receiver) -> None:
    """Neither an emergency stop to release, nor a lock that $X opens."""
    with sender(there) as one:
        until(one, b"ok\r\n")
        with opened(there) as page:
            assert page.ask(GOOD) == "OK"
            until(one, b"ALARM:57\r\n[MSG:A firmware update is being written: wait until it ends]\r\n")
            one.sendall(b"$X\n")
            until(one, b"error:")
            with sender(there) as later:
                until(later, b"[MSG:Locked by ALARM:57: a firmware update is being written: wait until it ends]")
        until(one, b"[MSG:Reset to continue]\r\n")  # it was called off


def test_a_stranger_at_the_page_does_not_keep_an_update_out(there: Receiver) -> None:
    with connect(f"ws://127.0.0.1:{there.page}/update", open_timeout=HANG_S) as stranger:
        assert bytes(stranger.recv(HANG_S)).startswith(b"WIFICNC-OTA 3 ")
        stranger.send(b"1")
        assert answer(there, GOOD) == "OK"
        assert bytes(stranger.recv(HANG_S)).startswith(b"ERROR another sender has connected")
