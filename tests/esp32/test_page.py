"""The page as the firmware serves it: files from flash, who may come, and Grbl's stream in a WebSocket."""

from __future__ import annotations

import gzip
import hashlib
import http.client
import json
import random
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
from esp32_serve import serving_esp32
from patience import HANG_S, wait_until
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from wificnc import __version__
from wificnc.errors import UserError
from wificnc.firmware.page_header import EmbeddedFile, embedded_files

HUB_PLACES = 4  # of telnet_serve.c
PLACES, HEAD = 32, 16384  # targets/pc/hal/net_sizes.h: the server runs on this computer
OTHER_METHODS = (b"POST", b"PUT", b"DELETE", b"OPTIONS", b"PATCH", b"TRACE", b"get")
CHUNKS = {
    "index.html": {
        "file": "assets/index-1.js",
        "isEntry": True,
        "css": ["assets/index-1.css"],
        "assets": ["assets/core-1.wasm"],
        "imports": ["_shared-1.js"],
        "dynamicImports": ["src/view/late.ts", "node_modules/esptool-js/lib/index.js"],
    },
    "_shared-1.js": {"file": "assets/shared-1.js"},
    "src/view/late.ts": {"file": "assets/late-1.js"},
    "node_modules/esptool-js/lib/index.js": {
        "file": "assets/lib-1.js",
        "imports": ["_shared-1.js"],
        "dynamicImports": ["node_modules/esptool-js/lib/esp32.js"],
    },
    "node_modules/esptool-js/lib/esp32.js": {"file": "assets/esp32-1.js"},
}
NEEDED = {"index-1.js", "index-1.css", "core-1.wasm", "shared-1.js", "late-1.js"}
LARGE = random.Random(1).randbytes(300_000)  # more than the kernel's buffers


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[EmbeddedFile]:
    """A page as Vite leaves one, without its meaning."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "assets").mkdir()
    (folder / "files.json").write_text(json.dumps(CHUNKS))
    contents = {f"assets/{name}": name.encode() for name in (*NEEDED, "lib-1.js", "esp32-1.js")}
    contents |= {"index.html": b"<!doctype html>hello", "assets/core-1.wasm": LARGE}
    for name, data in contents.items():
        (folder / name).write_bytes(data)
        (folder / f"{name}.gz").write_bytes(gzip.compress(data, mtime=0))
    return embedded_files(folder)


def get(port: int, path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=HANG_S)
    try:
        connection.request(method, path, headers={"Accept-Encoding": "gzip, deflate", **headers})
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


def answer_to(port: int, request: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), HANG_S) as one:
        one.sendall(request)
        return b"".join(iter(lambda: one.recv(65536), b""))


# ---- files ----


def test_the_firmware_carries_all_but_the_installer(files: list[EmbeddedFile]) -> None:
    assert {file.path for file in files} == {"/index.html", *(f"/assets/{name}" for name in NEEDED)}


def test_a_page_that_is_not_built_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="older version"):
        embedded_files(tmp_path)


def test_files_come_whole_with_type_tag_and_age(files: list[EmbeddedFile]) -> None:
    with serving_esp32(files=files) as ports:
        for file in files:
            status, headers, body = get(ports.page, file.path)
            assert (status, headers["Content-Type"], headers["Content-Encoding"]) == (200, file.type, "gzip")
            assert hashlib.sha256(body).hexdigest().startswith(file.tag)
            assert ("immutable" in headers["Cache-Control"]) == file.path.startswith("/assets/")
        status, headers, body = get(ports.page, "/?x=1")
        assert gzip.decompress(body) == b"<!doctype html>hello"
        tag = headers["ETag"]
        assert get(ports.page, "/", **{"If-None-Match": f'"x", W/{tag}'})[::2] == (304, b"")
        assert get(ports.page, "/", **{"If-None-Match": '"x"'})[0] == 200
        status, headers, body = get(ports.page, "/assets/core-1.wasm", "HEAD")
        assert (status, int(headers["Content-Length"]), body) == (200, len(gzip.compress(LARGE, mtime=0)), b"")


@pytest.mark.parametrize(
    ("path", "status"),
    [("/nothing", 404), ("/../index.html", 404), ("/assets/lib-1.js", 404), ("/assets", 404), ("/grbl", 426)],
)
def test_nothing_else_is_there(files: list[EmbeddedFile], path: str, status: int) -> None:
    with serving_esp32(files=files) as ports:
        assert get(ports.page, path)[0] == status


def test_who_takes_no_gzip_is_told(files: list[EmbeddedFile]) -> None:
    with serving_esp32(files=files) as ports:
        status, _, body = get(ports.page, "/", **{"Accept-Encoding": "identity"})
        assert status == 406 and b"gzip" in body


def test_a_firmware_without_its_page_says_so() -> None:
    with serving_esp32() as ports:
        status, _, body = get(ports.page, "/")
        assert status == 404 and b"does not include the web page" in body
        assert get(ports.page, "/api/controller")[0] == 200


def test_the_page_learns_who_serves_it() -> None:
    with serving_esp32() as ports:
        status, headers, body = get(ports.page, "/api/controller")
        assert (status, headers["Content-Type"]) == (200, "application/json")
        controller = {"name": "WiFiCNC-1A2B", "version": __version__, "board": "esp32s3-devkitc", "axes": 6}
        assert json.loads(body) == {**controller, "digest": ""}  # on this computer there is no image to name


# ---- bad requests ----


@pytest.mark.parametrize(
    ("request_text", "status"),
    [
        (b"hello\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nno colon\r\n\r\n", b"400"),
        (b"POST /grbl HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"405"),
        (b"GET / HTTP/1.1\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nHost: [::1\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: nonsense\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\0\r\n\r\n", b"400"),
        (b"\x16\x03\x01\x02\x00\x01", b"400"),
        (b"GET /\xff HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"400"),
        *((b"%s / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" % method, b"405") for method in OTHER_METHODS),
        (b"GET / HTTP/1.1\r\nHost: shop.lan\r\n\r\n", b"404"),
        (b"GET / HTTP/1.1\r\nHost: other.lan\r\n\r\n", b"421"),
        (b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", b"421"),
        (b"GET /" + b"a" * (HEAD - 6), b"431"),
    ],
)
def test_bad_requests_are_answered(request_text: bytes, status: bytes) -> None:
    with serving_esp32() as ports:
        assert answer_to(ports.page, request_text).startswith(b"HTTP/1.1 " + status)


@pytest.mark.parametrize("method", OTHER_METHODS)
def test_other_methods_are_told_what_is_allowed(method: bytes) -> None:
    with serving_esp32() as ports:
        request = b"%s /grbl HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4\r\n\r\n$J=X" % method
        assert b"\r\nAllow: GET, HEAD\r\n" in answer_to(ports.page, request)


@pytest.mark.slow
def test_a_header_that_comes_slowly_ends(files: list[EmbeddedFile]) -> None:
    """A byte now and then, which is never the last one."""
    with serving_esp32(files=files) as ports, socket.create_connection(("127.0.0.1", ports.page), HANG_S) as slow:
        slow.setblocking(False)
        slow.sendall(b"GET / HTTP/1.1\r\nX: ")
        ended = False
        end = time.monotonic() + HANG_S
        while not ended:
            assert time.monotonic() < end
            time.sleep(0.05)
            with suppress(BlockingIOError):
                try:
                    slow.send(b"x")
                    ended = slow.recv(1) == b""
                except ConnectionError:
                    ended = True


def test_strangers_who_hold_all_places_do_not_keep_the_page_from_others(files: list[EmbeddedFile]) -> None:
    """Silent ones, half requests, and readers that do not read: more than there are places."""
    big = b"GET /assets/core-1.wasm HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with serving_esp32(files=files) as ports, ExitStack() as crowd:
        for n in range(2 * PLACES):
            here = ("127.0.0.66", 0) if n % 2 else ("127.0.0.77", 0)
            one = crowd.enter_context(socket.create_connection(("127.0.0.1", ports.page), HANG_S, here))
            one.sendall((b"", b"GET / HT", big, big)[n % 4])
        for _ in range(5):
            assert get(ports.page, "/")[0] == 200


def test_silent_and_half_open_connections_make_room_in_time(files: list[EmbeddedFile]) -> None:
    with serving_esp32(files=files) as ports:
        silent = [socket.create_connection(("127.0.0.1", ports.page), HANG_S) for _ in range(PLACES + 2)]
        with suppress(ConnectionError):  # there are more than places: those who came first may have gone
            silent[0].sendall(b"GET / HT")
            silent[1].shutdown(socket.SHUT_WR)
        silent[-1].sendall(b"GET /assets/core-1.wasm HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")  # never read
        assert get(ports.page, "/")[0] == 200
        for one in silent:
            one.close()


@pytest.mark.slow
def test_a_slow_reader_has_longer_than_a_silent_one(files: list[EmbeddedFile]) -> None:
    """A telephone on poor WiFi takes nothing for some seconds; half a file would be a page that does not start."""
    with serving_esp32(files=files) as ports, socket.socket() as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, 536)  # the server's kernel buffers for 20 of them
        slow.settimeout(HANG_S)
        slow.connect(("127.0.0.1", ports.page))
        slow.sendall(b"GET /assets/core-1.wasm HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept-Encoding: gzip\r\n\r\n")
        for _ in range(2):  # one after the other, each until it is closed because it said nothing
            with socket.create_connection(("127.0.0.1", ports.page), HANG_S) as silent:
                assert silent.recv(1) == b""
        head, _, body = b"".join(iter(lambda: slow.recv(65536), b"")).partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 200") and gzip.decompress(body) == LARGE


# ---- the stream ----


class Stream:
    """Lines of the WebSocket."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.rest = b""

    def until(self, start: str) -> str:
        while True:
            while b"\n" not in self.rest:
                part = self.socket.recv(HANG_S)
                assert isinstance(part, bytes)
                self.rest += part
            line, _, self.rest = self.rest.partition(b"\n")
            if line.decode().startswith(start):
                return line.decode().strip()


@contextmanager
def stream(port: int, **options: str) -> Iterator[Stream]:
    with connect(f"ws://127.0.0.1:{port}/grbl", compression=None, **options) as socket:  # type: ignore[arg-type]
        yield Stream(socket)


def state(client: Stream) -> str:
    client.socket.send(b"?")
    return client.until("<")[1:].split("|")[0]


def wait_for(client: Stream, wanted: str) -> None:
    wait_until(lambda: state(client) == wanted, wanted)


@pytest.mark.parametrize("text", [False, True])
def test_lines_and_real_time_bytes_act(text: bool) -> None:
    def as_sent(data: str) -> str | bytes:
        return data if text else data.encode("latin-1")

    with serving_esp32() as ports, stream(ports.page) as client:
        client.socket.send(as_sent("$J=G91X9000F600\n"))
        client.until("ok")
        wait_for(client, "Jog")
        client.socket.send(as_sent("\x85"))
        wait_for(client, "Idle")
        client.socket.send([as_sent("G1X9"), as_sent("000"), as_sent("F600\n")])  # a message in pieces
        client.until("ok")
        wait_for(client, "Run")
        client.socket.send(as_sent("!"))
        wait_for(client, "Hold:0")


def test_a_page_from_elsewhere_gets_no_stream() -> None:
    with serving_esp32() as ports:
        with pytest.raises(InvalidStatus) as refused, stream(ports.page, origin="http://evil.example"):
            pass
        assert refused.value.response.status_code == 403
        with stream(ports.page, origin=f"http://127.0.0.1:{ports.page}") as client:
            assert state(client) == "Idle"


def test_one_owner_observers_and_a_key() -> None:
    with serving_esp32("correct horse") as ports, stream(ports.page) as owner, stream(ports.page) as observer:
        owner.until("[MSG:Locked")
        owner.socket.send("$LOGIN=correct horse\nG90\n")
        owner.until("ok")
        owner.until("ok")
        observer.until("[MSG:Locked")
        observer.socket.send("$LOGIN=correct horse\n")
        assert "is in control" in observer.until("[MSG:")
        observer.socket.send("G1X9000F600\n")
        assert "$TAKE" in observer.until("[MSG:")
        assert state(observer) == "Idle"


def test_no_byte_is_lost_when_a_browser_pours() -> None:
    lines = 1000
    with serving_esp32() as ports, stream(ports.page) as client:
        client.socket.send("G1X0.01F100\nG1X0\n" * (lines // 2))
        for _ in range(lines):
            client.until("ok")


def test_what_is_no_websocket_ends_with_the_reason() -> None:
    with serving_esp32() as ports, stream(ports.page) as client:
        client.socket.socket.sendall(b"\x81\x02?\n")  # a frame without a mask
        with pytest.raises(ConnectionClosed) as closed:
            client.until("never")
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1002


def test_pings_are_answered_and_a_close_is_clean() -> None:
    with serving_esp32() as ports, stream(ports.page) as client:
        assert client.socket.ping(b"there?").wait(HANG_S)
        client.socket.close(1000)
        assert client.socket.close_code == 1000


def test_a_fifth_browser_finds_no_place_and_hears_it() -> None:
    with serving_esp32() as ports:
        taken = ExitStack()
        for _ in range(HUB_PLACES):
            watcher = taken.enter_context(stream(ports.page))
            watcher.socket.send("?")
            watcher.until("<")
        with taken, stream(ports.page) as late:
            assert "all client slots are in use" in late.until("[MSG:")
