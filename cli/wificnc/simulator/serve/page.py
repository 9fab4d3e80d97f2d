"""The page of a serving controller: the web server of the firmware (targets/pc/page.h) with files of this computer.

Python finds the files and, for a browser, the other controllers of the network. HTTP, WebSockets and the rules of
access are those of targets/net/net_http.h.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import mimetypes
import os
import re
import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import unquote

from wificnc.build.checkout import checkout_root
from wificnc.build.host import ensure_host_library
from wificnc.connection.discover import Found, discover
from wificnc.errors import LinkError, ServeError, UserError
from wificnc.files import paths
from wificnc.simulator.serve.announce import EVERYWHERE, Announced, announced
from wificnc.simulator.serve.options import Address

DISCOVER_S = 2.0  # how long is listened
ADDRESS_SIZE = 64  # targets/net/net_socket.h
TAG_SIZE = 16
UNKNOWN_HOST = -1  # of page_listen()
PAGE_WOKEN, PAGE_ASKED = 0, 1  # enum page_event
NOT_OF_A_PAGE = re.compile(r"[\x00-\x1f:\\]")  # on Windows drives, streams and other computers
FIND_FILE = ctypes.CFUNCTYPE(None, ctypes.c_char_p)  # page_find

# Not what this computer's registry says of them: a script with a wrong type is not run.
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".wasm": "application/wasm",
    ".webmanifest": "application/manifest+json",
}


@dataclass(frozen=True)
class About:
    """What the page learns of the controller before it connects."""

    name: str
    version: str
    board: str
    axes: int


@dataclass(frozen=True)
class PageFile:
    """A file as it is served."""

    type: str
    tag: str
    packed: bytes | None
    plain: bytes
    forever: bool  # its name changes with its content


def page_folder() -> Path:
    """The built page: of this package, or of the checkout. Raises UserError when it was not built."""
    folder = paths.PAGE if paths.PAGE.is_dir() else checkout_root() / "web" / "dist"
    if not (folder / "index.html").is_file():
        raise UserError("the page is not built", hint="make web; it needs Node.js and npm")
    return folder


def find_file(folder: Path, path: str) -> PageFile | None:
    """A file as it is now, of this folder and nothing else. @param path  of a request"""
    root, wanted = folder.resolve(), unquote(path).lstrip("/")
    if NOT_OF_A_PAGE.search(wanted):
        return None
    file = (root / wanted).resolve()
    if file.is_dir():
        file = file / "index.html"
    if not file.is_relative_to(root) or not file.is_file() or file.suffix == ".gz":
        return None
    kind = TYPES.get(file.suffix) or mimetypes.guess_type(file.name)[0] or "application/octet-stream"
    packed, plain = file.with_name(f"{file.name}.gz"), file.read_bytes()
    tag = hashlib.sha256(plain).hexdigest()[:TAG_SIZE]
    forever = file.parent.name == "assets"  # their names have a hash of their content
    return PageFile(kind, tag, packed.read_bytes() if packed.is_file() else None, plain, forever)


class PageServer:
    """Serves from `with` until it ends, in a thread of its own.

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
        names: Sequence[str] = (),
        announce: Callable[[Address, int, str], Announced | None] = announced,
        mdns: Address = EVERYWHERE,
    ) -> None:
        """controller: host:port of its TCP stream; None: only the files, as any web host has them.

        names: by which browsers may ask for the page, in addition to its address and this computer's name.
        """
        self.url = ""
        self.found_by_name: bool | None = None  # None: no other computer reaches it
        self._announce, self._mdns, self._board = announce, mdns, about.board
        self._address = address
        self._controller = controller
        self._find = find
        self._name = socket.gethostname().encode()
        self._names = ",".join(names).encode()
        self._about = json.dumps(asdict(about)).encode() if controller else None
        self._texts: list[bytes] = []  # what the server has pointers to
        self._folder = folder
        self._find_file = FIND_FILE(self._put_file)
        self._answer: tuple[bytes, bytes, bytes] | None = None  # of the search: status, type, body
        self._ending = False
        self._lock = threading.Lock()  # no one wakes a page that has gone
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    def __enter__(self) -> PageServer:
        self._library = _load_library()
        self._page = ctypes.c_void_p(self._library.page_create(self._name, self._names, self._about, self._find_file))
        if not self._page:
            raise MemoryError
        if self._controller:
            host, _, port = self._controller.rpartition(":")
            self._library.page_set_controller(self._page, self._keep(host.strip("[]")), self._keep(port))
        bound = self._listen()
        self.url = f"http://{Address(self._address.host, bound)}/"
        if who := self._announce(self._address, bound, self._board):
            at = self._mdns
            self.found_by_name = self._library.page_announce(self._page, ctypes.byref(who), at.host.encode(), at.port)
        self._thread.start()
        return self

    def _listen(self) -> int:
        """@return the port."""
        bound = ctypes.create_string_buffer(ADDRESS_SIZE)
        wanted = self._address.host.encode(), str(self._address.port).encode()
        if error := self._library.page_listen(self._page, *wanted, bound):
            self._library.page_close(self._page)
            why = "host not found" if error == UNKNOWN_HOST else os.strerror(error)
            raise ServeError(f"--http {self._address}: {why}", hint="port 0 takes any free one")
        return int(bound.value.decode().rpartition(":")[2])

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._ending = True
            self._library.page_wake(self._page)
        self._thread.join()
        self._library.page_close(self._page)

    def _keep(self, text: str) -> bytes:
        self._texts.append(text.encode())
        return self._texts[-1]

    def _put_file(self, path: bytes) -> None:
        """A file that vanishes meanwhile is not there."""
        with suppress(OSError, ValueError, RuntimeError):  # the last one of links in a circle
            if file := find_file(self._folder, path.decode(errors="replace")):
                packed = len(file.packed) if file.packed else 0
                texts = (file.type.encode(), file.tag.encode())
                copies = (file.packed, packed, file.plain, len(file.plain))
                self._library.page_put_file(self._page, *texts, *copies, file.forever)
                self._file = file, texts  # until the next one: what the server has pointers to

    def _run(self) -> None:
        while not self._ending:
            event = self._library.page_run(self._page)
            if event == PAGE_ASKED:
                threading.Thread(target=self._search, name="discover", daemon=True).start()
            elif event != PAGE_WOKEN:
                return
            elif self._answer:
                self._library.page_found(self._page, *self._answer)
                self._answer = None

    def _search(self) -> None:
        """It takes seconds, in which others are served."""
        try:
            found = self._find()
        except LinkError as error:
            said = f"{error}: {error.hint}\n"
            self._answer = (b"503 Service Unavailable", b"text/plain; charset=utf-8", said.encode())
        else:
            rows = [{"name": one.name, "address": one.address, "board": one.text.get("wificnc", "")} for one in found]
            self._answer = (b"200 OK", b"application/json", json.dumps(rows).encode())
        with self._lock:
            if not self._ending:
                self._library.page_wake(self._page)


def _load_library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(ensure_host_library()))
    text, size, page = ctypes.c_char_p, ctypes.c_uint32, ctypes.c_void_p
    library.page_create.restype = page
    library.page_create.argtypes = [text, text, text, FIND_FILE]
    library.page_put_file.argtypes = [page, text, text, text, size, text, size, ctypes.c_bool]
    library.page_set_controller.argtypes = [page, text, text]
    library.page_announce.restype = ctypes.c_bool
    library.page_announce.argtypes = [page, ctypes.c_void_p, text, ctypes.c_uint16]
    library.page_listen.argtypes = [page, text, text, text]
    library.page_run.argtypes = library.page_wake.argtypes = library.page_close.argtypes = [page]
    library.page_found.argtypes = [page, text, text, text]
    return library
