"""The page over HTTP, and Grbl's stream of bytes in a WebSocket: what a browser needs of a serving controller.

    browser ── GET /, /assets/... ────── files of the built page, gzip where there is a .gz beside
            ── GET /api/controller ───── who serves, as JSON
            ── GET /api/discover ─────── controllers in this network, as JSON; a browser cannot look itself
            ── WebSocket /grbl ───────── one TCP connection to the controller each, byte for byte

The controller itself keeps the rules of owner, observers and password, as for every other client. What is ours is who
may come: pages from elsewhere may not, whatever they are told that our address is.
"""

from __future__ import annotations

import asyncio
import ipaddress
import json
import mimetypes
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from http import HTTPStatus
from pathlib import Path
from urllib.parse import unquote, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from wificnc.build.checkout import checkout_root
from wificnc.errors import LinkError, ServeError, UserError
from wificnc.link.discover import Found, discover
from wificnc.serve.options import Address

STREAM = "/grbl"
ABOUT = "/api/controller"
DISCOVER = "/api/discover"
DISCOVER_S = 2.0  # how long is listened
READ_SIZE = 4096
MESSAGE_MAX = 1 << 16  # bytes of a message from the browser
REALTIME_FIRST, REALTIME_LAST = 0x80, 0xA1  # real-time bytes beyond ASCII (core/link/rx.h)
SECURITY = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "frame-ancestors 'none'",
}


@dataclass(frozen=True)
class About:
    """What the page learns of the controller before it connects."""

    name: str
    version: str
    board: str
    axes: int


def page_folder() -> Path:
    """The built page: of this package, or of the checkout. Raises UserError when it was not built."""
    packaged = Path(__file__).parents[1] / "page"
    folder = packaged if packaged.is_dir() else checkout_root() / "web" / "dist"
    if not (folder / "index.html").is_file():
        raise UserError("the page is not built", hint="make web; it needs Node.js and npm")
    return folder


class PageServer:
    """Serves from `with` to its end, in a thread of its own.

    Raises:
        ServeError: on entry, when the address cannot be had.
    """

    def __init__(
        self,
        address: Address,
        controller: str | None,
        about: About,
        folder: Path,
        find: Callable[[], list[Found]] = lambda: discover(DISCOVER_S),
    ) -> None:
        """controller: host:port of its TCP stream; None: only the files, as any web host has them."""
        self.url = ""
        self._address = address
        self._controller = controller
        self._about = about
        self._find = find
        self._files = Files(folder)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._ready = threading.Event()
        self._ended = asyncio.Event()
        self._error: OSError | None = None

    def __enter__(self) -> PageServer:
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            self._thread.join()
            raise ServeError(
                f"--http {self._address}: {self._error.strerror or self._error}", hint="port 0 takes any free one"
            )
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()

    def _run(self) -> None:
        with suppress(asyncio.CancelledError):
            self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        try:
            server = await serve(
                self._handle,
                self._address.host,
                self._address.port,
                process_request=self._answer,
                compression=None,  # lines are short, and latency counts
                max_size=MESSAGE_MAX,
                server_header=None,
            )
        except OSError as error:
            self._error = error
            self._ready.set()
            return
        async with server:
            self.url = f"http://{_bound(server, self._address)}/"
            self._ready.set()
            await self._ended.wait()

    # ---- one request ----

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """None: it goes on as a WebSocket."""
        host = request.headers.get("Host", "")
        if not is_our_host(host):
            return _refuse(HTTPStatus.MISDIRECTED_REQUEST, f"{host} is not a name of this controller: use its address")
        path = unquote(urlsplit(request.path).path)
        if path == STREAM and self._controller is not None:
            origin = request.headers.get("Origin")
            if origin is not None and urlsplit(origin).netloc != host:
                return _refuse(HTTPStatus.FORBIDDEN, f"refused: the page comes from another origin, {origin}")
            return None
        if path == ABOUT and self._controller is not None:
            return _response(HTTPStatus.OK, "application/json", json.dumps(asdict(self._about)).encode())
        if path == DISCOVER and self._controller is not None:
            return await self._discover()
        return self._files.get(path, "gzip" in request.headers.get("Accept-Encoding", ""))

    async def _discover(self) -> Response:
        try:
            found = await asyncio.to_thread(self._find)
        except LinkError as error:
            return _refuse(HTTPStatus.SERVICE_UNAVAILABLE, f"{error}: {error.hint}")
        rows = [{"name": one.name, "address": one.address, "board": one.text.get("wificnc", "")} for one in found]
        return _response(HTTPStatus.OK, "application/json", json.dumps(rows).encode())

    async def _handle(self, browser: ServerConnection) -> None:
        assert self._controller is not None
        host, _, port = self._controller.rpartition(":")
        try:
            reader, writer = await asyncio.open_connection(host.strip("[]"), int(port))
        except OSError:
            await browser.close(1013, "the controller has ended")
            return
        pumps = {
            asyncio.ensure_future(_to_controller(browser, writer)),
            asyncio.ensure_future(_to_browser(reader, browser)),
        }
        try:
            _, left = await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
            for pump in left:
                pump.cancel()
            await asyncio.gather(*left, return_exceptions=True)
        finally:
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()


async def _to_controller(browser: ServerConnection, writer: asyncio.StreamWriter) -> None:
    """A controller that is full is waited for, and so is the browser then: nothing is lost."""
    with suppress(ConnectionClosed, OSError):
        async for message in browser:
            writer.write(stream_bytes(message))
            await writer.drain()


async def _to_browser(reader: asyncio.StreamReader, browser: ServerConnection) -> None:
    with suppress(ConnectionClosed, OSError):
        while data := await reader.read(READ_SIZE):
            await browser.send(data)
    await browser.close(1001, "the controller has closed the connection")


def stream_bytes(message: str | bytes) -> bytes:
    """A message as bytes of the stream: binary as it is, text with its real-time characters as single bytes.

    A browser's text is UTF-8, in which the jog cancel 0x85 is C2 85, and the á of a comment C3 A1: as bytes of the
    stream that were two commands. Other characters beyond ASCII are left out, as every controller does.
    """
    if isinstance(message, bytes):
        return message
    return bytes(ord(c) for c in message if ord(c) < 0x80 or REALTIME_FIRST <= ord(c) <= REALTIME_LAST)


def is_our_host(host: str) -> bool:
    """Whether the Host of a request can be ours: an address, or a name that no name server of others gives away.

    A page of the internet can have its own name lead here (DNS rebinding); then the browser takes us for its server.
    """
    name = urlsplit(f"//{host}").hostname or ""
    if name in ("localhost", socket.gethostname().lower()) or name.endswith(".local"):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class Files:
    """The files of a folder, and nothing else."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()

    def get(self, path: str, gzip: bool) -> Response:
        file = (self._folder / path.lstrip("/")).resolve()
        if file.is_dir():
            file = file / "index.html"
        if not file.is_relative_to(self._folder) or not file.is_file() or file.suffix == ".gz":
            return _refuse(HTTPStatus.NOT_FOUND, f"file not found: {path}")
        kind = TYPES.get(file.suffix) or mimetypes.guess_type(file.name)[0] or "application/octet-stream"
        # Names of assets have a hash of their content: they never change.
        headers = {"Cache-Control": "max-age=31536000, immutable" if file.parent.name == "assets" else "no-cache"}
        packed = file.with_name(f"{file.name}.gz")
        if gzip and packed.is_file():
            return _response(HTTPStatus.OK, kind, packed.read_bytes(), {**headers, "Content-Encoding": "gzip"})
        return _response(HTTPStatus.OK, kind, file.read_bytes(), headers)


# Not what this computer's registry says of them: a wrong type of a script is no script.
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".wasm": "application/wasm",
}


def _refuse(status: HTTPStatus, why: str) -> Response:
    return _response(status, "text/plain; charset=utf-8", f"{why}\n".encode())


def _response(status: HTTPStatus, kind: str, body: bytes, more: Mapping[str, str] | None = None) -> Response:
    head = {"Content-Type": kind, "Content-Length": str(len(body)), **SECURITY, **(more or {})}
    return Response(status, status.phrase, Headers(head), body)


def _bound(server: Server, address: Address) -> str:
    """host:port, with the port that was free."""
    port: int = next(iter(server.sockets)).getsockname()[1]
    return str(Address(address.host, port))
