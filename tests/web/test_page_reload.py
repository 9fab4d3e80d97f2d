"""A reload of the page in the middle of a job: its text and its place are there again, and nothing starts by itself."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from console_page import SLOW, Console, load, square
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


def reload(console: Console) -> None:
    """As a user who confirms the browser's question."""
    console.page.once("dialog", lambda dialog: dialog.accept())
    console.page.reload()


KEPT = """async (state) => {
    const open = indexedDB.open("wificnc");
    await new Promise((resolve) => (open.onsuccess = resolve));
    const read = open.result.transaction("job").objectStore("job").getAll();
    await new Promise((resolve) => (read.onsuccess = resolve));
    open.result.close();
    const [place, text] = read.result;
    return place?.state === state && place.id === text?.id;
}"""


def is_kept(console: Console, state: str) -> None:
    """The browser's database has it: a reload does not wait for what is being written."""
    console.page.wait_for_function(KEPT, arg=state)


def run_until_line(console: Console, line: int) -> None:
    """Until a later one is marked as being executed, or this one."""
    console.page.wait_for_function(
        "line => Number(/▸\\s*(\\d+)/.exec(document.querySelector('pre.code')?.textContent ?? '')?.[1]) >= line",
        arg=line,
    )


def test_a_job_is_resumed_after_a_reload(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=0.2)  # 20 s, of which the reload needs one
    load(console, square(40) + "M30\n")
    console.by("job-start").click()
    console.is_in("Run")
    run_until_line(console, 12)
    console.clock(SLOW)
    reload(console)
    expect(console.page.get_by_text("This page was closed or loaded again during the job")).to_be_visible()
    console.is_in("Hold")  # the controller has lost its sender ($74), and this page has sent nothing
    line = int(console.by("resume-line").input_value())
    assert 1 < line <= 163  # of reports before the reload: what came after them is cut again, and nothing is left out
    expect(console.by("job-time")).to_be_visible()
    console.tab("terminal")
    expect(console.by("terminal")).not_to_contain_text("G1")
    console.tab("job")
    console.page.screenshot(path="build/tests/reload.png")
    console.clock(5)
    console.rests()
    console.by("reset").click()
    console.is_in("Idle")
    console.by("resume-plan").click()
    preamble = console.by("resume-preamble").inner_text().splitlines()
    assert preamble[:2] == ["G21G90G94G17G54", "G0Z1"]
    console.by("resume-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    is_kept(console, "done")
    reload(console)
    console.is_in("Idle")
    expect(console.by("job-start")).to_be_enabled()
    expect(console.by("resume-line")).to_have_value("1")
    console.by("job-close").click()
    expect(console.page.get_by_text("Drop a G-code file here")).to_be_visible()
    reload(console)
    console.is_in("Idle")
    expect(console.page.get_by_text("Drop a G-code file here")).to_be_visible()


def test_a_job_that_is_closed_stays_closed(socket_link: Callable[..., Console]) -> None:
    """Also where the page is loaded again before the browser's database has forgotten it."""
    console = socket_link()
    load(console, square(4))
    expect(console.by("job-start")).to_be_enabled()
    console.page.evaluate("IDBObjectStore.prototype.clear = () => {}")
    console.by("job-close").click()
    expect(console.page.get_by_text("Drop a G-code file here")).to_be_visible()
    reload(console)
    console.is_in("Idle")
    expect(console.page.get_by_text("Drop a G-code file here")).to_be_visible()
    load(console, square(4))  # the same text is another loading of it
    expect(console.by("job-start")).to_be_enabled()
    is_kept(console, "ready")
    reload(console)
    expect(console.by("job-start")).to_be_enabled()


def test_a_resume_that_is_left_before_its_line_begins_at_that_line(socket_link: Callable[..., Console]) -> None:
    """Its first lines restore the state and are not of the file: a reload in them must not lead to line 1."""
    console = socket_link()
    load(console, square(40))
    console.by("resume-line").fill("60")
    console.by("resume-line").blur()
    console.by("resume-plan").click()
    expect(console.by("resume-preamble")).to_contain_text("G4P4")
    console.clock(SLOW)  # the spindle runs up for four seconds
    console.by("resume-start").click()
    console.is_in("Run")
    is_kept(console, "running")
    reload(console)
    expect(console.page.get_by_text("This page was closed or loaded again during the job")).to_be_visible()
    assert int(console.by("resume-line").input_value()) == 60


def test_a_browser_that_keeps_nothing_says_so(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.page.add_init_script("indexedDB.open = () => { throw new Error('storage is off') }")
    console.page.reload()
    console.is_in("Idle")
    console.knows("G54")  # else the check begins again behind it, and Start asks
    load(console, square(2))
    expect(console.page.get_by_text("This browser does not keep the job (storage is off)")).to_be_visible()
    console.by("job-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
