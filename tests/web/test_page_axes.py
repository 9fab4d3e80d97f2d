"""A machine of three axes on a board of six: the page has what the machine has."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from patience import HANG_S
from playwright.sync_api import Page, expect
from web_fixture import Watched
from wificnc.board.load import load_board
from wificnc.profile import load_machine
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

BOARD = "esp32-wroom32"
PROFILE = load_machine("shapeoko3")


@contextmanager
def page_of(built_page: Path, watched: Callable[..., Watched], *settings: str) -> Iterator[tuple[Page, Server]]:
    board = load_board(BOARD)
    assert len(board.axes) == 6
    options = ServeOptions(board=board, tcp=Address("127.0.0.1", 0), control=0, settings=settings)
    about = About("WiFiCNC in a test", "0", board.id, len(board.axes))
    with (
        Server(options) as server,
        PageServer(Address("127.0.0.1", 0), server.tcp, about, built_page) as served,
        watched() as context,
    ):
        page = context.page(served.url)
        page.locator("[data-test=state]", has_text=re.compile("Idle|Alarm")).wait_for()
        yield page, server


def letters_of(page: Page, selector: str, attribute: str) -> set[str]:
    """Axes that these elements are of."""
    values = [element.get_attribute(attribute) or "" for element in page.locator(selector).all()]
    return {found[1] for value in values if (found := re.search(r"(?:work-|jog-|Zero )([XYZABC])", value))}


@pytest.mark.parametrize(("settings", "axes"), [(PROFILE.settings_lines(), "XYZ"), ([], "XYZABC")])
def test_the_page_has_the_axes_of_the_machine(
    built_page: Path, watched: Callable[..., Watched], settings: list[str], axes: str
) -> None:
    with page_of(built_page, watched, *settings) as (page, _):
        expect(page.locator(f"[data-test=work-{axes[-1]}]")).to_have_text("0.000")
        assert letters_of(page, "[data-test^=work-]", "data-test") == set(axes)
        assert letters_of(page, "[data-test^=jog-]", "data-test") == set(axes)
        assert letters_of(page, "button[aria-label^='Zero ']", "aria-label") == set(axes)
        expect(page.locator("[aria-label=Inputs]").get_by_text("limit", exact=False)).to_have_text(
            [f"{axis} limit" for axis in axes]
        )
        page.click("#tab-settings")
        page.locator("[data-test=setting-102]").wait_for()
        last = len(axes) - 1
        expect(page.locator(f"[data-test=setting-{100 + last}]")).to_have_count(1)
        expect(page.locator(f"[data-test=setting-{100 + last + 1}]")).to_have_count(0)


def test_it_homes_and_zeroes_these_axes_alone(built_page: Path, watched: Callable[..., Watched]) -> None:
    fast = ("$25=3000", "$24=600", "$22=1")
    with page_of(built_page, watched, *PROFILE.settings_lines(), *fast) as (page, server):
        expect(page.locator("[data-test=state]")).to_have_text("Alarm")
        host, _, port = (server.control or "").rpartition(":")
        with socket.create_connection((host, int(port)), HANG_S) as hands, hands.makefile() as answers:
            for axis in "xyz":
                hands.sendall(f"travel {axis} -110 5\n".encode())
                assert answers.readline().strip() == "ok"
        page.click("[data-test=home]")
        expect(page.locator("[data-test=state]")).to_have_text("Idle")
        expect(page.locator("[data-test=work-X]")).to_have_text("-5.000")
        page.get_by_role("button", name="Zero all").click()
        for axis in "XYZ":
            expect(page.locator(f"[data-test=work-{axis}]")).to_have_text("0.000")
        assert page.locator(".dro-axis").count() == len("XYZ"), "A, B and C did not come with the reports"
        page.get_by_role("button", name="10", exact=True).first.click()
        page.click("[data-test='jog-X−']")
        expect(page.locator("[data-test=work-X]")).to_have_text("-10.000")
