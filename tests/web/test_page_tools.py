"""The tool table in the page: read, stored, changed and cleared, in both units, and while a job waits for its tool."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from console_page import Console, load, typed
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

CHANGE = "G21G90\nT7 M6 (ball nose)\nG1X1F600\nM30\n"


def fill(console: Console, **values: str) -> None:
    for name, value in values.items():
        console.by(f"tool-{name}").fill(value)


def row(console: Console, number: int) -> list[str]:
    cells = console.by("tools").locator("tr", has=console.by(f"tool-{number}")).locator("td")
    return [text.strip() for text in cells.all_inner_texts()]


def test_a_tool_is_stored_changed_and_cleared(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.by("tools-open").click()
    expect(console.by("tools-none")).to_be_visible()
    fill(console, number="2", length="12,5", diameter="6", text="6 mm flat")
    console.by("tool-store").click()
    expect(console.by("tool-2")).to_be_visible()
    assert row(console, 2) == ["T2", "12.500", "6.000", "6 mm flat"]
    fill(console, number="97")
    expect(console.by("tool-store")).to_be_disabled()
    fill(console, number="2", text="Fräser")
    expect(console.page.get_by_text("letters without accents")).to_be_visible()
    console.by("tool-2").click()
    expect(console.by("tool-length")).to_have_value("12.500")
    fill(console, diameter="5.9")
    console.by("tool-store").click()
    expect(console.by("tools")).to_contain_text("5.900")
    assert row(console, 2) == ["T2", "12.500", "5.900", "6 mm flat"]
    console.by("tool-clear").click()
    expect(console.by("tools-none")).to_be_visible()
    console.page.keyboard.press("Escape")


def test_inches_are_called_inches(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=("$13=1",))
    console.by("tools-open").click()
    fill(console, number="1", length="1", diameter="0.25", text="1/4 in")
    expect(console.page.get_by_role("dialog").get_by_text("Diameter, inch").first).to_be_visible()
    console.by("tool-store").click()
    expect(console.by("tool-1")).to_be_visible()
    assert row(console, 1) == ["T1", "1.0000", "0.2500", "1/4 in"]
    console.page.keyboard.press("Escape")
    typed(console, "$#")
    expect(console.by("terminal")).to_contain_text("|0.1250|1/4 in]")


def test_a_tool_is_stored_while_the_job_waits_for_it(socket_link: Callable[..., Console]) -> None:
    """The form begins with the tool that is asked for."""
    console = socket_link()
    load(console, CHANGE)
    console.by("job-start").click()
    console.is_in("Hold")
    console.by("park").click()
    console.tab("control")
    console.by("tools-open").click()
    expect(console.by("tool-number")).to_have_value("7")
    fill(console, diameter="8", text="ball nose")
    console.by("tool-store").click()
    expect(console.by("tool-7")).to_be_visible()
    assert row(console, 7) == ["T7", "0.000", "8.000", "ball nose"]
    console.page.keyboard.press("Escape")
    console.by("resume").click()
    console.is_in("Idle")
    console.stands_at(X=1)
