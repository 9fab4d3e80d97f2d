"""The page gives the firmware a network: npm's Improv at one end, our C at the other, bytes in between."""

from __future__ import annotations

import os
import pty
import subprocess
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from bridge import Bridge
from playwright.sync_api import Page, expect
from web_fixture import Watched
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program
from wificnc.simulator.serve.options import Address
from wificnc.simulator.serve.page import About, PageServer

HERE = Path(__file__).parent
ESP32 = checkout_root() / "targets" / "esp32"


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Path]:
    """The serial port of a board that runs."""
    sources = [HERE / "improv_board.c", ESP32 / "link" / "improv.c"]
    program = build_program(sources, checkout_root() / "build" / "tests" / "improv_board", "release", [f"-I{ESP32}"])
    master, slave = pty.openpty()
    tty.setraw(slave)
    process = subprocess.Popen([program], stdin=master, stdout=master)
    try:
        yield Path(os.ttyname(slave))
    finally:
        process.kill()
        process.wait()
        os.close(master)
        os.close(slave)


@pytest.fixture
def page(board: Path, built_page: Path, watched: Callable[..., Watched], bridge: Bridge) -> Iterator[Page]:
    with (
        PageServer(Address("127.0.0.1", 0), None, About("", "", "", 0), built_page) as host,
        watched(bypass_csp=True) as context,
    ):
        # bypass_csp: the stand-in's WebSocket is no part of the page
        context.context.add_init_script(bridge.stand_in(board))
        opened = context.page(host.url)
        opened.click("#tab-network")
        yield opened


def join(page: Page, network: str, password: str) -> None:
    page.fill("[data-test=join-network]", network)
    page.fill("[data-test=join-password]", password)
    page.click("[data-test=join]")


def test_a_network_is_joined(page: Page) -> None:
    join(page, "Werkstatt", "half past eight!")
    expect(page.get_by_text("WiFiCNC-1A2B is on this network")).to_be_visible()
    expect(page.get_by_text("WiFiCNC 1.0, http://192.168.1.20/")).to_be_visible()


def test_networks_are_looked_for_and_one_is_taken(page: Page) -> None:
    page.click("[data-test=scan]")
    expect(page.get_by_role("button", name="Freifunk")).to_be_visible()
    page.get_by_role("button", name="Werkstatt").click()
    expect(page.locator("[data-test=join-network]")).to_have_value("Werkstatt")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("network", "password", "said"),
    [
        ("Nowhere", "half past eight", "The board cannot connect to this network"),
        ("Werkstatt", "short", "The board rejected this name or password"),
        ("moving", "half past eight", "The board cannot join or search for a network now"),
    ],
)
def test_a_refusal_in_words(page: Page, network: str, password: str, said: str) -> None:
    join(page, network, password)
    expect(page.get_by_role("alert").filter(has_text=said)).to_be_visible()
    expect(page.locator("[data-test=join]")).to_have_text("Join")
