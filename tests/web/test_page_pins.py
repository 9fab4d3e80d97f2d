"""Pins moved over the network: Chromium, the firmware's own server, and a storage that is made up."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from esp32_serve import Contact, first_contact
from playwright.sync_api import Page, expect
from web_fixture import Watched
from wificnc.firmware.page_header import embedded_files

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

KEY = "correct horse"
REFUSED = re.compile(r"status of (401|409)")  # Chromium's words for a refusal that a test asks for


@pytest.fixture
def contact(built_page: Path) -> Iterator[Contact]:
    with first_contact(KEY, embedded_files(built_page)) as running:
        yield running


@pytest.fixture
def page(contact: Contact, watched: Callable[..., Watched]) -> Iterator[Page]:
    with watched() as browser:
        opened = browser.page(f"http://127.0.0.1:{contact.page}/#pins")
        opened.locator("[data-test=pins-read]").click()
        expect(opened.get_by_text("What WiFiCNC-1A2B has stored.")).to_be_visible()
        yield opened
        browser.errors[:] = [text for text in browser.errors if not REFUSED.search(text)]


def write(page: Page, key: str) -> None:
    page.locator("[data-test=pins-key]").fill(key)
    page.locator("[data-test=pins-write]").click()


def test_a_pin_is_moved_over_the_network(contact: Contact, page: Page) -> None:
    pin = page.locator("[data-test=pin-p_prb]")
    expect(pin).to_have_value("14")
    pin.select_option("255")
    write(page, KEY)
    expect(page.get_by_text("The controller has restarted with the new pins, and they stay")).to_be_visible()
    assert "pin=1 restarts=1" in contact.tell("state")  # the wiring before was stored, too: it returns if no one comes
    expect(pin).to_have_value("255")
    expect(page.locator("[data-test=pins-write]")).to_have_count(0)


def test_a_refusal_is_shown_and_the_choice_stays(contact: Contact, page: Page) -> None:
    page.locator("[data-test=pin-p_prb]").select_option("255")
    write(page, "wrong horse")
    expect(page.get_by_role("alert").filter(has_text="This is not the access key.")).to_be_visible()
    contact.tell("moves 1")
    write(page, KEY)
    expect(page.get_by_role("alert").filter(has_text="a job is running or held")).to_be_visible()
    assert "pin=0 restarts=0" in contact.tell("state")
    expect(page.locator("[data-test=pin-p_prb]")).to_have_value("255")


def test_two_signals_change_places(contact: Contact, page: Page) -> None:
    """In one choice; back in another one. Neither is unwired in between."""
    first, second = page.locator("[data-test=pin-p_sx]"), page.locator("[data-test=pin-p_sy]")
    own, other = first.input_value(), second.input_value()
    first.select_option(other)
    expect(first).to_have_value(other)
    expect(second).to_have_value(own)
    expect(page.get_by_text("The firmware would refuse this")).to_have_count(0)
    expect(page.locator("[data-test=pins-write]")).to_be_visible()
    second.select_option(other)
    expect(first).to_have_value(own)
    expect(page.locator("[data-test=pins-write]")).to_have_count(0)
