"""A reload of the page in the middle of a job: its text and its place are there again, and nothing starts by itself."""

from __future__ import annotations

import re
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


def keeps_its_job(console: Console, line: int) -> None:
    """In a hold another file does not take its place."""
    console.by("job-file").set_input_files({"name": "other.nc", "mimeType": "text/plain", "buffer": b"G0X1\n"})
    notice = console.page.get_by_role("strong").filter(has_text="The machine is in a hold: press Resume")
    expect(notice).to_be_visible()
    expect(console.by("job-close")).to_be_disabled()
    assert int(console.by("resume-line").input_value()) == line


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
    keeps_its_job(console, line)
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


PAUSED = "G21G90\nG1X5F3000\nM0\nG1X10\nM30\n"


@pytest.mark.parametrize("inches", [0, 1])
def test_a_pause_is_known_after_a_reload(socket_link: Callable[..., Console], inches: int) -> None:
    """M0 stops the lines behind it, the page's questions too, whose answers it has kept."""
    console = socket_link(settings=(f"$13={inches}",))
    load(console, PAUSED)
    console.by("job-start").click()
    console.rests()
    reload(console)
    console.rests()
    console.tab("control")
    expect(console.page.get_by_role("heading", name="Position, inch" if inches else "Position, mm")).to_be_visible()
    console.stands_at(X=round(5 / 25.4, 3) if inches else 5)
    console.knows("G54")
    console.tab("job")
    expect(console.by("checked-with")).to_contain_text(
        "With the settings, the offsets and the place of the connected machine"
    )
    console.tab("settings")
    expect(console.page.locator("[aria-label^='$130 ']").first).to_have_value(re.compile("^300"))


def test_another_browser_in_a_pause_says_what_waits(socket_link: Callable[..., Console]) -> None:
    """It has nothing to go by: no defaults, no request to connect, and a check as soon as the pause ends."""
    console = socket_link(settings=("$13=1",))
    load(console, PAUSED)
    console.by("job-start").click()
    console.rests()
    console.page.evaluate("localStorage.clear()")
    reload(console)
    console.rests()
    waits = "The controller reports its settings and offsets when this pause has ended. State and position are known."
    console.tab("control")
    expect(console.page.get_by_role("heading", name="Position, unit not reported yet")).to_be_visible()
    console.stands_at(X=round(5 / 25.4, 3))
    for tab in ("job", "settings", "guide"):
        console.tab(tab)
        expect(console.page.get_by_text(waits)).to_be_visible()
        expect(console.page.locator("#view")).not_to_contain_text("onnect to")
        expect(console.page.locator("#view")).not_to_contain_text("default settings")
    console.tab("job")
    console.by("resume").click()
    console.is_in("Idle")
    expect(console.by("checked-with")).to_contain_text(
        "With the settings, the offsets and the place of the connected machine"
    )
    expect(console.page.get_by_text(waits)).to_have_count(0)
    console.tab("control")
    expect(console.page.get_by_role("heading", name="Position, inch")).to_be_visible()


# A text of a job finds no room; places, which are small, do. As Chromium ends it: without an exception.
NO_ROOM = """() => {
    const put = IDBObjectStore.prototype.put;
    IDBObjectStore.prototype.put = function (value, key) {
        const asked = put.call(this, value, key);
        if (key === "text") setTimeout(() => { try { this.transaction.abort(); } catch { /* it has ended */ } });
        return asked;
    };
}"""


def test_a_full_storage_is_said_before_the_start(socket_link: Callable[..., Console]) -> None:
    """And stays said: the place of the job, which is written at each step, does not make it kept."""
    console = socket_link(speed=SLOW)
    console.page.evaluate(NO_ROOM)
    load(console, square(40))
    warning = console.page.get_by_text("This browser does not keep the job (the browser's storage is full)")
    expect(warning).to_be_visible()
    console.by("job-start").click()
    console.is_in("Run")
    run_until_line(console, 3)
    expect(warning).to_be_visible()
