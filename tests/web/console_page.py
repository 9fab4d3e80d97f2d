"""A page that is connected to a controller: by the WebSocket of `wificnc serve --http`, or by a serial port."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from bridge import Bridge
from patience import HANG_S
from playwright.sync_api import Locator, Page, expect
from web_fixture import Watched, serving
from wificnc.simulator.serve.options import Address
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

ABOUT = About("WiFiCNC in a test", "0", "host", 6)


def hands_say(server: Server, line: str) -> str:
    """A line at the control door."""
    host, _, port = (server.control or "").rpartition(":")
    with socket.create_connection((host, int(port)), HANG_S) as door:
        door.sendall(f"{line}\n".encode())
        with door.makefile() as answers:
            return answers.readline().strip()


SLOW = 0.05  # of real time: a second of cutting takes 20 s, however long a busy computer takes for a click


PLACE_MS = 3000  # of web/src/press.ts: the time in which nothing else acts where another button was


def press(control: Locator) -> None:
    """Until it is taken: what has just appeared, moved or changed, and what is where another button was, takes no
    presses for a moment."""
    control.click()
    if control.page.locator("[data-ignored]").count():
        control.page.wait_for_function(
            "until_ms => performance.now() > until_ms",
            arg=control.page.evaluate("performance.now()") + PLACE_MS,
        )
        control.click()
    expect(control.page.locator("[data-ignored]")).to_have_count(0)


class Console:
    """A page that is connected, its controller, and the link between them."""

    def __init__(self, page: Page, server: Server, cut: Callable[[], None], mend: Callable[[], None]) -> None:
        self.page = page
        self.server = server
        self.cut = cut
        self.mend = mend

    def by(self, test_id: str) -> Locator:
        return self.page.locator(f"[data-test='{test_id}']")

    def press(self, test_id: str) -> None:
        press(self.by(test_id))

    def tab(self, name: str) -> None:
        self.page.click(f"#tab-{name}")

    def is_in(self, state: str) -> None:
        expect(self.by("state")).to_have_text(state)

    def position(self, axis: str) -> float:
        return float(self.by(f"work-{axis}").inner_text())

    def stands_at(self, **axes: float) -> None:
        for axis, value in axes.items():
            expect(self.by(f"work-{axis}")).to_have_text(f"{value:.3f}")

    def knows(self, *modes: str) -> None:
        """The page has asked for the modes since they are these. Of the tab Control."""
        for word in modes:
            expect(self.page.locator(".facts").first).to_contain_text(word)

    def rests(self) -> None:
        """In a hold, and at rest there: a reset keeps the position."""
        self.is_in("Hold")
        expect(self.by("state")).to_have_attribute("data-substate", "0")  # 1: it is still slowing down

    def hands(self, line: str) -> str:
        """A line at the control door."""
        return hands_say(self.server, line)

    def clock(self, speed: float) -> None:
        """The machine's time, as a part of real time: slow while the page must be in time for what is under way."""
        assert self.hands(f"speed {speed:g}") == "ok"


@pytest.fixture(params=["socket", "serial"])
def link(
    request: pytest.FixtureRequest,
    built_page: Path,
    watched: Callable[..., Watched],
    bridge: Bridge,
    tmp_path: Path,
) -> Iterator[Callable[..., Console]]:
    """Start a controller and connect the page to it."""
    with ExitStack() as stack:
        make = _by_socket if request.param == "socket" else _by_serial

        def start(**options: object) -> Console:
            return _connected(stack.enter_context(make(built_page, watched, bridge, tmp_path, **options)), options)

        yield start


@pytest.fixture
def socket_link(
    built_page: Path, watched: Callable[..., Watched], bridge: Bridge, tmp_path: Path
) -> Iterator[Callable[..., Console]]:
    """As link, over the WebSocket alone: for what no link can change."""
    with ExitStack() as stack:

        def start(**options: object) -> Console:
            return _connected(
                stack.enter_context(_by_socket(built_page, watched, bridge, tmp_path, **options)), options
            )

        yield start


def _connected(console: Console, options: dict[str, object]) -> Console:
    console.is_in("Alarm" if "$22=1" in options.get("settings", ()) else "Idle")  # type: ignore[operator]
    console.knows("G54")  # the last question of all: a job that is loaded now is checked once
    return console


@contextmanager
def _by_socket(
    built_page: Path, watched: Callable[..., Watched], _bridge: Bridge, tmp_path: Path, **options: object
) -> Iterator[Console]:
    with serving(tmp_path, **options) as server, ExitStack() as stack:  # type: ignore[arg-type]
        first = stack.enter_context(PageServer(Address("127.0.0.1", 0), server.tcp, ABOUT, built_page))
        again = Address("127.0.0.1", int(first.url.rstrip("/").rpartition(":")[2]))

        def mend() -> None:
            stack.enter_context(PageServer(again, server.tcp, ABOUT, built_page))

        with watched() as context:
            yield Console(context.page(first.url), server, stack.close, mend)


@contextmanager
def _by_serial(
    built_page: Path, watched: Callable[..., Watched], bridge: Bridge, tmp_path: Path, **options: object
) -> Iterator[Console]:
    with (
        serving(tmp_path, pty=True, **options) as server,  # type: ignore[arg-type]
        PageServer(Address("127.0.0.1", 0), None, ABOUT, built_page) as host,
        watched(bypass_csp=True) as context,  # the stand-in's WebSocket is no part of the page
    ):
        context.context.add_init_script(bridge.stand_in(tmp_path / "tty"))
        page = context.page(host.url)
        page.click("[data-test=connect]")
        page.click("[data-test=connect-serial]")
        yield Console(page, server, bridge.unplug, bridge.plug)


def square(rounds: int, side: float = 1.0) -> str:
    """A tenth of a second for each round, and four lines."""
    corners = ((side, 0.0), (side, side), (0.0, side), (0.0, 0.0))
    return "G21G90G0Z1\nM3S1000\nG1Z-1F1000\n" + "".join(
        f"G1X{x:g}Y{y:g}F3000 (round {n})\n" for n in range(rounds) for x, y in corners
    )


def load(console: Console, text: str, name: str = "square.nc") -> None:
    console.tab("job")
    console.by("job-file").set_input_files({"name": name, "mimeType": "text/plain", "buffer": text.encode()})
    expect(console.by("job-time")).to_be_visible()


def typed(console: Console, line: str) -> None:
    console.tab("terminal")
    console.by("terminal-line").fill(line)
    console.by("terminal-line").press("Enter")


SWITCHES = ("$22=1", "$21=1", "$25=3000", "$24=600", "$26=5", "$27=2", "$46=0", "$47=0", "$48=0")


def home(console: Console) -> None:
    """The machine's zero is where the switches are, and it is 2 mm ($27) away from them."""
    for axis in "xyz":
        assert console.hands(f"travel {axis} -290 0.5") == "ok"
    console.by("home").click()
    console.is_in("Idle")
