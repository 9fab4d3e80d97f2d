"""A built page, a headless Chromium, a served controller, and serial ports that are WebSockets."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from bridge import Bridge
from patience import HANG_S
from playwright.sync_api import Browser, BrowserContext, Page, Request, expect, sync_playwright
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.lock import build_lock
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

from web.build import build_page, missing_tools

CHROMIUM = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")  # the first one starts fastest
TIMEOUT_MS = 1000 * HANG_S
expect.set_options(timeout=TIMEOUT_MS)
DESKTOP = {"width": 1440, "height": 900}
# Chromium's words: no firmware/index.json next to the page; a lost link that is tried again.
NO_FAULT = re.compile(r"404|WebSocket connection to '\S+' failed")
LOOPBACK = {"127.0.0.1", "localhost", "::1"}

# Fast enough that a test's jobs take a second or two of real time.
MACHINE = tuple(
    f"${base + ax}={value}" for base, value in ((100, 80), (110, 6000), (120, 5000), (130, 300)) for ax in range(3)
)


@pytest.fixture(scope="session")
def built_page() -> Path:
    """web/dist, built from what is here now; where .ci/run has done that a moment ago, as it is."""
    if why := missing_tools():
        pytest.skip(f"the page cannot be built: {why}")
    if os.environ.get("WIFICNC_PAGE_IS_BUILT"):
        return checkout_root() / "web" / "dist"
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID", "")  # all workers of a run have the same; alone there is none
    folder = checkout_root() / "build" / "web" / "tests"
    with build_lock(folder):
        built_for = folder / "run"
        if not run or not built_for.exists() or built_for.read_text() != run:
            build_page()
            built_for.write_text(run)
    return checkout_root() / "web" / "dist"


@pytest.fixture(scope="session")
def browser(built_page: Path) -> Iterator[Browser]:
    program = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        pytest.skip("there is no Chromium on this computer: apt-get install chromium")
    with sync_playwright() as playwright:
        # --no-sandbox: root, as in CI's containers, has none
        chromium = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield chromium
        chromium.close()


class Watched:
    """A browser's context whose every request, message and error is kept. Left before its server ends: what the page
    asks for behind that would be refused, and this is no fault of the page."""

    def __init__(self, context: BrowserContext) -> None:
        self.context = context
        self.outside: list[str] = []
        self.errors: list[str] = []
        context.set_default_timeout(TIMEOUT_MS)
        context.on("request", self._request)
        context.on("weberror", lambda error: self.errors.append(str(error.error)))

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *_error: object) -> None:
        self.context.close()

    def page(self, url: str) -> Page:
        page = self.context.new_page()
        page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        page.goto(url)
        return page

    def _request(self, request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("data", "blob") and parts.hostname not in LOOPBACK:
            self.outside.append(request.url)


@pytest.fixture
def watched(browser: Browser) -> Iterator[Callable[..., Watched]]:
    """Open a context with these options; at the end nothing may have been asked of elsewhere, or have failed."""
    opened: list[Watched] = []

    def open_context(**options: object) -> Watched:
        context = browser.new_context(**{"viewport": DESKTOP, **options})  # type: ignore[arg-type]
        opened.append(Watched(context))
        return opened[-1]

    yield open_context
    for each in opened:
        each.context.close()
    assert [url for each in opened for url in each.outside] == [], "the page asks something of elsewhere"
    errors = [text for each in opened for text in each.errors if not NO_FAULT.search(text)]
    assert errors == [], f"the page has failed somewhere: {errors}"


@contextmanager
def serving(
    tmp_path: Path, pty: bool = False, key: str = "", settings: tuple[str, ...] = (), speed: float = 1.0
) -> Iterator[Server]:
    options = ServeOptions(
        board=load_board("host"),
        tcp=Address("127.0.0.1", 0),
        pty=tmp_path / "tty" if pty else None,
        control=0,
        key=key,
        speed=speed,
        settings=(*MACHINE, *settings),
    )
    with Server(options) as server:
        yield server


@pytest.fixture
def serve_page(built_page: Path, tmp_path: Path) -> Iterator[Callable[..., tuple[Server, PageServer]]]:
    """Start a controller and its page."""
    with ExitStack() as stack:

        def start(**options: object) -> tuple[Server, PageServer]:
            server = stack.enter_context(serving(tmp_path, **options))  # type: ignore[arg-type]
            about = About("WiFiCNC in a test", "0", "host", len(server.options.board.axes))
            page = stack.enter_context(PageServer(Address("127.0.0.1", 0), server.tcp, about, built_page))
            return server, page

        yield start


@pytest.fixture
def console(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> Callable[..., tuple[Server, Page]]:
    """A controller, and its page that is connected and idle."""

    def start(**options: object) -> tuple[Server, Page]:
        server, served = serve_page(**options)
        page = watched().page(served.url)
        page.locator("[data-test=state]", has_text="Idle").wait_for()
        return server, page

    return start


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    with Bridge() as running:
        yield running
