"""What is served over HTTP, who may come, and that the stream in the WebSocket is the controller's, byte for byte."""

from __future__ import annotations

import gzip
import http.client
import json
import re
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from layouts import HOST
from patience import HANG_S
from playwright.sync_api import expect
from web_fixture import Watched, serving
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from wificnc.connection.discover import Found
from wificnc.errors import LinkError, ServeError, UserError
from wificnc.simulator.serve.announce import Announced, announced
from wificnc.simulator.serve.options import Address, parse_host_name
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

ABOUT = About("a test", "1", "host", 6)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A page as small as one can be."""
    (tmp_path / "page" / "assets").mkdir(parents=True)
    (tmp_path / "page" / "index.html").write_text("<!doctype html>hello")
    (tmp_path / "page" / "assets" / "a.js").write_text("1")
    (tmp_path / "page" / "assets" / "a.js.gz").write_bytes(gzip.compress(b"1"))
    (tmp_path / "secret").write_text("secret")
    return tmp_path / "page"


@contextmanager
def page_of(server: Server | None, folder: Path) -> Iterator[PageServer]:
    tcp = server.tcp if server else None
    with PageServer(Address("127.0.0.1", 0), tcp, ABOUT, folder, names=("shop.lan", "cnc.lan")) as page:
        yield page


def get(page: PageServer, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection(urlsplit(page.url).netloc, timeout=HANG_S)
    try:
        connection.request("GET", path, headers={"Accept-Encoding": "identity", **headers})
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


@contextmanager
def stream(page: PageServer, **options: object) -> Iterator[Stream]:
    url = page.url.replace("http:", "ws:") + "grbl"
    with connect(url, compression=None, **options) as socket:  # type: ignore[arg-type]
        yield Stream(socket)


class Stream:
    """Lines of a WebSocket's stream."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.rest = b""

    def line(self) -> str:
        while b"\n" not in self.rest:
            part = self.socket.recv(HANG_S)
            assert isinstance(part, bytes)
            self.rest += part
        line, _, self.rest = self.rest.partition(b"\n")
        return line.decode().strip()

    def until(self, *starts: str) -> str:
        while not (line := self.line()).startswith(starts):
            pass
        return line


# ---- files ----


def test_files_with_types_and_gzip(folder: Path) -> None:
    with page_of(None, folder) as page:
        status, headers, body = get(page, "/")
        assert (status, body) == (200, b"<!doctype html>hello")
        assert headers["Content-Type"] == "text/html; charset=utf-8"
        status, headers, body = get(page, "/assets/a.js", **{"Accept-Encoding": "gzip, br"})
        assert (status, headers["Content-Encoding"], gzip.decompress(body)) == (200, "gzip", b"1")
        assert headers["Content-Type"].startswith("text/javascript")
        assert "immutable" in headers["Cache-Control"]
        assert get(page, "/assets/a.js")[2] == b"1"


@pytest.mark.parametrize(
    "path", ["/../secret", "/%2e%2e/secret", "/assets/../../secret", "/nothing", "/assets/a.js.gz"]
)
def test_nothing_but_the_page(folder: Path, path: str) -> None:
    with page_of(None, folder) as page:
        assert get(page, path)[0] == 404


def test_a_plain_web_host_has_no_controller(folder: Path) -> None:
    with page_of(None, folder) as page:
        assert get(page, "/api/controller")[0] == 404


def test_the_page_learns_who_serves_it(tmp_path: Path, folder: Path) -> None:
    with serving(tmp_path) as server, page_of(server, folder) as page:
        status, headers, body = get(page, "/api/controller")
        assert (status, headers["Content-Type"]) == (200, "application/json")
        assert json.loads(body) == {"name": "a test", "version": "1", "board": "host", "axes": 6}


def test_other_controllers_are_found_for_the_browser(tmp_path: Path, folder: Path) -> None:
    mill = Found("wificnc-1a2b", "192.168.1.20", 23, {"wificnc": "esp32s3-zero"})
    with serving(tmp_path) as server:
        address = Address("127.0.0.1", 0)
        with PageServer(address, server.tcp, ABOUT, folder, find=lambda: [mill]) as page:
            status, headers, body = get(page, "/api/discover")
    assert (status, headers["Content-Type"]) == (200, "application/json")
    assert json.loads(body) == [{"name": "wificnc-1a2b", "address": "192.168.1.20", "board": "esp32s3-zero"}]


def test_the_network_finds_the_page(folder: Path) -> None:
    """By multicast DNS: asked as a simple resolver asks, the packet read by zeroconf."""
    zeroconf, const = pytest.importorskip("zeroconf"), pytest.importorskip("zeroconf.const")
    me = announced(Address("192.0.2.7", 0), 8080, "host")
    assert me is not None
    me.address[:] = (127, 0, 0, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        mdns = Address(*free.getsockname())
    with (
        PageServer(Address("127.0.0.1", 0), None, ABOUT, folder, announce=lambda *_: me, mdns=mdns) as page,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking,
    ):
        assert page.found_by_name
        query = zeroconf.DNSOutgoing(const._FLAGS_QR_QUERY)
        query.add_question(zeroconf.DNSQuestion("_http._tcp.local.", const._TYPE_PTR, const._CLASS_IN))
        asking.settimeout(HANG_S)
        asking.sendto(query.packets()[0], (mdns.host, mdns.port))
        found = {record.type: record for record in zeroconf.DNSIncoming(asking.recv(2000)).answers()}
    assert found[const._TYPE_SRV].port == 8080
    assert found[const._TYPE_TXT].text.startswith(b"\x06path=/\x0aboard=host")
    assert socket.inet_ntoa(found[const._TYPE_A].address) == "127.0.0.1"


def test_a_page_of_this_computer_alone_is_not_announced(folder: Path) -> None:
    with page_of(None, folder) as page:
        assert page.found_by_name is None
    for host in ("127.0.0.1", "localhost", "::1", "::"):
        assert announced(Address(host, 0), 8080, "host") is None


@pytest.mark.parametrize(("own", "address"), [("192.0.2.9", [192, 0, 2, 9]), ("", None), ("127.0.0.1", None)])
def test_a_page_at_all_addresses_is_announced_with_that_of_the_network(
    monkeypatch: pytest.MonkeyPatch, own: str, address: list[int] | None
) -> None:
    monkeypatch.setattr("wificnc.simulator.serve.announce._own_address", lambda: own)
    found = announced(Address("0.0.0.0", 0), 8080, "host")
    assert (list(found.address) if found else None) == address


def test_two_pages_of_a_computer_have_two_names() -> None:
    one, other = (announced(Address("192.0.2.7", 0), port, "host") for port in (8080, 65535))
    assert one and other and one.name != other.name and len(other.name) <= 31
    assert re.fullmatch(rb"WiFiCNC-[A-Za-z0-9-]+", other.name)
    theirs = HOST.struct("net_mdns")
    assert [(name, getattr(theirs, name).offset) for name, _ in theirs._fields_] == [
        (name, getattr(Announced, name).offset) for name, _ in Announced._fields_
    ]


def test_no_network_to_look_in_is_said(tmp_path: Path, folder: Path) -> None:
    def find() -> list[Found]:
        raise LinkError(
            "cannot ask this network: unreachable", hint="check that this computer is connected to a network"
        )

    with serving(tmp_path) as server:
        address = Address("127.0.0.1", 0)
        with PageServer(address, server.tcp, ABOUT, folder, find=find) as page:
            status, _, body = get(page, "/api/discover")
    assert status == 503 and b"check that this computer is connected to a network" in body


def test_a_page_that_is_built_again_is_served(folder: Path) -> None:
    with page_of(None, folder) as page:
        _, headers, _ = get(page, "/")
        assert get(page, "/", **{"If-None-Match": headers["ETag"]})[::2] == (304, b"")
        (folder / "index.html").write_text("<!doctype html>news")
        assert get(page, "/", **{"If-None-Match": headers["ETag"]})[::2] == (200, b"<!doctype html>news")
        (folder / "assets" / "a.js.gz").unlink()
        (folder / "assets" / "a.js").write_text("2")
        assert get(page, "/assets/a.js", **{"Accept-Encoding": "gzip"})[2] == b"2"


def test_each_encoding_has_its_own_tag(folder: Path) -> None:
    with page_of(None, folder) as page:
        tags = {get(page, "/assets/a.js", **{"Accept-Encoding": how})[1]["ETag"] for how in ("gzip", "identity")}
        assert len(tags) == 2


def test_a_folder_is_its_index(folder: Path) -> None:
    (folder / "some docs").mkdir()
    (folder / "some docs" / "index.html").write_text("docs")
    with page_of(None, folder) as page:
        assert {get(page, path)[2] for path in ("/some%20docs", "/some%20docs/", "/some%20docs/index.html")} == {
            b"docs"
        }


# ---- addresses ----


def test_a_port_in_use_is_an_error(folder: Path) -> None:
    with page_of(None, folder) as page:
        taken = Address("127.0.0.1", urlsplit(page.url).port or 0)
        with pytest.raises(ServeError, match=r"--http 127\.0\.0\.1:[0-9]+: Address already in use") as error:
            PageServer(taken, None, ABOUT, folder).__enter__()
    assert error.value.hint == "port 0 takes any free one"


def test_a_host_that_does_not_exist_is_an_error(folder: Path) -> None:
    with pytest.raises(ServeError, match=r"--http no\.such\.host\.invalid:0: host not found"):
        PageServer(Address("no.such.host.invalid", 0), None, ABOUT, folder).__enter__()


# ---- who may come ----


@pytest.mark.parametrize(
    ("host", "ours"),
    [
        ("127.0.0.1:8080", True),
        ("[::1]:8080", True),
        ("localhost", True),
        (socket.gethostname(), True),
        ("192.168.1.20:8080", True),
        ("wificnc-1a2b.local", True),
        ("evil.example", False),
        ("localhost.evil.example:8080", False),
        ("shop.lan", True),
        ("SHOP.lan:8080", True),
        ("other.lan", False),
    ],
)
def test_a_name_that_leads_here_from_elsewhere_gets_nothing(folder: Path, host: str, ours: bool) -> None:
    with page_of(None, folder) as page:
        assert get(page, "/", Host=host)[0] == (200 if ours else 421)


BAD_PATHS = ("/%00", "/%zz", "/a\\b", "/\xe4", "/a%")
ODD_PATHS = ("/%ff%fe", "/C:/windows", "/%5c%5cother%5cshare", "/" + "a" * 300, "/a\x7f%20", "/%0d%0a", "//other/share")


@pytest.mark.parametrize("path", [*BAD_PATHS, *ODD_PATHS])
def test_a_path_that_no_file_has(folder: Path, path: str, capfd: pytest.CaptureFixture[str]) -> None:
    with (
        page_of(None, folder) as page,
        socket.create_connection((urlsplit(page.url).hostname, urlsplit(page.url).port)) as one,
    ):
        one.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode("latin-1"))
        status = b"".join(iter(lambda: one.recv(4096), b"")).split(b" ")[1]
        assert status == (b"400" if path in BAD_PATHS or "\x7f" in path else b"404")
    assert capfd.readouterr().err == "", "no traceback"


@pytest.mark.parametrize("name", ["", "*", "shop lan", "http://shop.lan", "shop.lan:80", "shop.lan,", "-x", "a" * 64])
def test_a_name_that_no_host_has_is_refused(name: str) -> None:
    with pytest.raises(UserError, match="is not a host name"):
        parse_host_name(name)


def test_a_page_from_elsewhere_gets_no_stream(tmp_path: Path, folder: Path) -> None:
    with serving(tmp_path) as server, page_of(server, folder) as page:
        with pytest.raises(InvalidStatus) as refused, stream(page, origin="http://evil.example"):
            pass
        assert refused.value.response.status_code == 403
        with stream(page, origin=page.url.rstrip("/")) as own:
            own.socket.send(b"?")
            assert own.until("<").startswith("<Idle|")


# ---- the stream ----


@pytest.mark.parametrize("text", [False, True])
def test_real_time_bytes_act(tmp_path: Path, folder: Path, text: bool) -> None:
    """+10 % and the jog cancel, as bytes and as UTF-8 text."""
    with serving(tmp_path) as server, page_of(server, folder) as page, stream(page) as own:

        def send(data: bytes) -> None:
            own.socket.send(data.decode("latin-1") if text else data)

        send(b"$J=G91X200F600\n")
        assert own.until("ok") == "ok"
        send(b"\x91?")
        while (report := own.until("<")).startswith(("<Idle|MPos:0.000,", "<Jog|MPos:0.000,")):
            send(b"?")
        assert report.startswith("<Jog|")
        send(b"\x85?")
        while not (report := own.until("<")).startswith("<Idle|"):
            send(b"?")
        assert 0.0 < float(report.split("MPos:")[1].split(",")[0]) < 200.0
        while "|Ov:" not in report:
            send(b"?")
            report = own.until("<")
        assert report.split("|Ov:")[1].startswith("110,100,100")


def test_no_byte_is_lost_when_a_browser_pours(tmp_path: Path, folder: Path) -> None:
    """Far more lines than the controller's buffers hold, in one go; each is answered once."""
    lines = 20_000
    with serving(tmp_path, speed=0.0) as server, page_of(server, folder) as page, stream(page) as own:
        job = "".join(f"G1X{n % 7}F6000\n" for n in range(lines)).encode()
        for at in range(0, len(job), 60_000):
            own.socket.send(job[at : at + 60_000])
        for _ in range(lines):
            assert own.until("ok", "error") == "ok"


def test_one_owner_and_observers(tmp_path: Path, folder: Path) -> None:
    """The page is a client like every other: who comes second watches, `$TAKE` changes that."""
    with serving(tmp_path) as server, page_of(server, folder) as page, stream(page) as first, stream(page) as second:
        first.socket.send("G21\n")
        assert first.until("ok") == "ok"
        second.socket.send("G21\n")
        assert second.until("[MSG:Observer").endswith("$TAKE takes control]")
        second.socket.send("$TAKE\nG20\n")
        assert second.until("ok") == "ok"
        assert first.until("[MSG:Observer")


def test_an_access_key(tmp_path: Path, folder: Path) -> None:
    with serving(tmp_path, key="open sesame") as server, page_of(server, folder) as page, stream(page) as own:
        own.socket.send("G21\n")
        assert "Locked" in own.until("[MSG:")
        own.socket.send("$LOGIN=a guess\n")
        assert "Wrong access key" in own.until("[MSG:Wrong")
        own.socket.send("?")
        assert own.until("<").startswith("<Idle|")
    with serving(tmp_path, key="open sesame") as server, page_of(server, folder) as page, stream(page) as own:
        own.socket.send("$LOGIN=open sesame\nG21\n")
        assert [own.until("ok"), own.until("ok")] == ["ok", "ok"]


def test_the_browser_is_told_when_the_controller_ends(tmp_path: Path, folder: Path) -> None:
    with serving(tmp_path) as server, page_of(server, folder) as page, stream(page) as own:
        own.socket.send("?")
        own.until("<")
        server.stop()
        with pytest.raises(Exception, match="1001"):
            while True:
                own.line()


@pytest.mark.slow  # opens a browser, for which the page is built
def test_the_page_lists_other_controllers(built_page: Path, watched: Callable[..., Watched], tmp_path: Path) -> None:
    mill = Found("wificnc-1a2b", "192.168.1.20", 23, {"wificnc": "esp32s3-zero"})
    with serving(tmp_path) as server:
        address = Address("127.0.0.1", 0)
        with PageServer(address, server.tcp, ABOUT, built_page, find=lambda: [mill]) as host, watched() as context:
            page = context.page(host.url)
            page.click("#tab-network")
            page.click("[data-test=discover]")
            expect(page.get_by_role("link", name="wificnc-1a2b")).to_have_attribute("href", "http://192.168.1.20/")
