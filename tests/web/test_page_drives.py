"""Motor drivers with registers, and the spindle's drive, on the settings tab: state, faults, settings."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from patience import HANG_S
from playwright.sync_api import Page, expect
from slow import deep_but
from test_screens import AXE, LOOKS, SCREENS, broken_rules
from web_fixture import MACHINE, Watched
from wificnc.board.load import load_board
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

ONE_LOOK = deep_but("light".__eq__, LOOKS)


@contextmanager
def settings_tab(
    built_page: Path, watched: Callable[..., Watched], board_id: str, *settings: str, look: str = "light"
) -> Iterator[tuple[Page, Server]]:
    board = load_board(board_id)
    options = ServeOptions(board=board, tcp=Address("127.0.0.1", 0), control=0, settings=(*MACHINE, *settings))
    about = About("WiFiCNC in a test", "0", board.id, len(board.axes))
    with (
        Server(options) as server,
        PageServer(Address("127.0.0.1", 0), server.tcp, about, built_page) as served,
        watched(reduced_motion="reduce", bypass_csp=True, **LOOKS[look]) as context,
    ):
        page = context.page(served.url)
        page.locator("[data-test=state]", has_text=re.compile("Idle|Alarm")).wait_for()
        page.add_script_tag(path=AXE)
        page.click("#tab-settings")
        yield page, server


def hands(server: Server, line: str) -> None:
    host, _, port = (server.control or "").rpartition(":")
    with socket.create_connection((host, int(port)), HANG_S) as control, control.makefile() as answers:
        control.sendall(f"{line}\n".encode())
        assert answers.readline().strip() == "ok"


def apply(page: Page) -> None:
    page.click("[data-test=settings-send]")
    expect(page.get_by_role("dialog")).to_have_count(0)


def looked_at(page: Page, name: str, look: str) -> None:
    SCREENS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SCREENS / f"{name}-{look}.png")
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    assert wide <= 0, f"{name} is {wide} px wider than the screen"
    assert broken_rules(page) == []


@pytest.mark.parametrize("look", ONE_LOOK)
def test_drivers_are_shown_changed_and_verified(built_page: Path, watched: Callable[..., Watched], look: str) -> None:
    with settings_tab(built_page, watched, "fysetc-e4", look=look) as (page, server):
        row = page.locator("[data-test=driver-X]")
        expect(row).to_contain_text("not written")
        expect(page.locator("[data-test=drivers] tbody tr")).to_have_count(4)
        page.click("[data-test=driver-change-X]")
        dialog = page.get_by_role("dialog")
        page.locator("[data-test=field-140]").fill("1768")
        expect(dialog).to_contain_text("allows at most 1767 mA")
        expect(page.locator("[data-test=driver-review]")).to_be_disabled()
        page.locator("[data-test=field-140]").fill("800")
        page.locator("[data-test=field-150]").select_option("32")
        expect(dialog).to_contain_text("Steps/mm in proportion: $100 = 160.000")
        looked_at(page, "driver-dialog", look)
        page.click("[data-test=driver-review]")
        review = page.locator("[data-test=settings-review] tbody tr")
        expect(review).to_have_count(3)
        apply(page)
        expect(row).to_contain_text("verified")
        expect(row).to_contain_text("800 mA")
        looked_at(page, "drivers", look)
        hands(server, "driver x hot")
        expect(page.locator("[data-test=state]")).to_have_text("Hold")
        expect(page.get_by_text("Driver X: it becomes too hot")).to_be_visible()
        hands(server, "driver x short")
        expect(row.locator(".chip")).to_have_text("short circuit")
        expect(page.get_by_text("Its outputs are off. Switch off, check motor and cable.")).to_be_visible()
        page.locator("[data-test=drivers]").scroll_into_view_if_needed()
        looked_at(page, "drivers-fault", look)
        # an alarm that only a reset ends: what happens to the driver meanwhile is shown
        expect(page.locator("[data-test=state]")).to_have_text("Alarm")
        expect(page.get_by_role("button", name="Reset", exact=True).first).to_be_visible()
        hands(server, "driver x shut-down")
        expect(row.locator(".chip")).to_have_text("too hot, shut down")


def test_in_motion_nothing_is_changed(built_page: Path, watched: Callable[..., Watched]) -> None:
    with settings_tab(built_page, watched, "xpro-v5", "$110=60") as (page, _):
        page.click("[data-test=driver-change-X]")
        # 0.325 V / 50 mOhm / sqrt 2: the resistor of the board file
        expect(page.get_by_role("dialog")).to_contain_text("at most 4596 mA")
        page.keyboard.press("Escape")
        page.click("#tab-terminal")
        page.locator("[data-test=terminal-line]").fill("G1 X50 F60")
        page.keyboard.press("Enter")
        expect(page.locator("[data-test=state]")).to_have_text("Run")
        page.click("#tab-settings")
        page.click("[data-test=driver-change-X]")
        expect(page.get_by_role("dialog")).to_contain_text("Settings cannot be changed now")
        expect(page.get_by_role("dialog")).to_contain_text("The machine is busy")
        page.locator("[data-test=field-140]").fill("800")
        expect(page.locator("[data-test=driver-review]")).to_be_disabled()


@pytest.mark.parametrize("look", ONE_LOOK)
def test_the_spindle_is_chosen_and_shows_speed_and_load(
    built_page: Path, watched: Callable[..., Watched], look: str
) -> None:
    with settings_tab(built_page, watched, "host", "$30=24000", look=look) as (page, _):
        choice = page.locator("[data-test=field-395]")
        expect(choice.locator("option")).to_have_count(10)
        choice.select_option(label="Delta MS300")
        expect(page.locator("[data-test=field-460]")).to_have_value("1")
        expect(page.locator("[data-test=field-462]")).to_have_count(0)
        page.locator("[data-test=field-461]").fill("30")
        page.click("[data-test=spindle-review]")
        expect(page.locator("[data-test=settings-review] tbody tr")).to_have_count(2)
        apply(page)
        looked_at(page, "spindle", look)
        page.click("#tab-inout")
        page.get_by_label("Spindle speed, rpm").fill("6000")
        page.get_by_role("button", name="Clockwise", exact=True).click()
        page.click("#tab-settings")
        expect(page.locator("[data-test=spindle-now]")).to_contain_text(re.compile(r"6000 rpm, measured \d+, [\d.]+ A"))
        expect(page.get_by_text("The spindle is on: switch it off first")).to_be_visible()
        expect(page.locator("[data-test=spindle-review]")).to_be_disabled()


def test_a_board_without_them_has_no_such_cards(built_page: Path, watched: Callable[..., Watched]) -> None:
    with settings_tab(built_page, watched, "esp32-wroom32") as (page, _):
        page.locator("[data-test=setting-102]").wait_for()
        expect(page.locator("[data-test=drivers]")).to_have_count(0)
        expect(page.locator("[data-test=spindle-now]")).to_have_count(0)
