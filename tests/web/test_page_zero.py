"""Work zero by hand: typed, halved, undone, in a named work system."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from console_page import Console, typed
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


def test_positions_are_typed_halved_zeroed_and_undone(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    page = console.page
    typed(console, "G20")  # the program's units; the page stays in mm, and leaves them
    console.tab("control")
    expect(page.locator(".facts")).to_contain_text("G20")
    console.by("work-X").click()
    console.by("typed-X").fill("40,5")
    console.by("typed-X").press("Escape")
    console.stands_at(X=0)
    console.by("work-X").click()
    console.by("typed-X").fill("4o")
    console.by("typed-X").press("Enter")
    expect(console.by("typed-X")).to_have_attribute("aria-invalid", "true")
    console.by("typed-X").fill("40,5")
    console.by("typed-X").press("Enter")
    console.stands_at(X=40.5, Y=0, Z=0)
    page.get_by_role("button", name="Halve X").click()
    console.stands_at(X=20.25)
    page.get_by_role("button", name="Zero all").click()
    console.stands_at(X=0, Y=0, Z=0)
    for x in (20.25, 40.5, 0):
        console.by("undo-zero").click()
        console.stands_at(X=x)
        console.knows("G20")
    expect(console.by("undo-zero")).to_be_disabled()
    expect(page.locator(".facts")).to_contain_text("G20")


def test_a_work_system_has_a_name(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    system = console.page.get_by_label("Work system")
    system.select_option("G59.3")
    expect(console.page.locator(".facts")).to_contain_text("G59.3")
    console.by("name-system").click()
    console.by("system-name").fill("Tool setter")
    console.by("system-name").press("Enter")
    expect(system.locator("option:checked")).to_have_text("G59.3 Tool setter")
    console.page.reload()
    console.is_in("Idle")
    expect(system.locator("option:checked")).to_have_text("G59.3 Tool setter")
    before = console.by("work-X").evaluate("element => parseFloat(getComputedStyle(element).fontSize)")
    console.by("large").click()
    large = console.by("work-X").evaluate("element => parseFloat(getComputedStyle(element).fontSize)")
    assert large > 1.8 * before > 60
