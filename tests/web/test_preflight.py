"""The preflight is that of the connected machine: its offsets, its place, its travel."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from console_page import SLOW, SWITCHES, Console, home, load, typed
from playwright.sync_api import Locator, expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

WIDE = "G21G90G17G54\nG0X0Y0Z5\nG1Z-1F500\nG1X250F3000\nG1Y10\nG0Z5\n"


def path(console: Console) -> Locator:
    return console.page.get_by_role("img", name=re.compile("^Path of"))


def refused(console: Console, text: str) -> None:
    """Start asks, with the reason, and Cancel starts nothing."""
    console.by("job-start").click()
    expect(console.page.get_by_role("dialog")).to_contain_text(text)
    console.page.get_by_role("button", name="Cancel").click()
    expect(console.by("job-stop")).to_be_disabled()


def homed(console: Console) -> None:
    home(console)
    console.tab("control")
    console.stands_at(X=-2, Y=-2, Z=-2)


def test_soft_limits_are_those_of_the_machine_with_its_work_zero(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=(*SWITCHES, "$20=1"), speed=8.0)
    homed(console)
    typed(console, "G53G0X-290Y-100Z-50")
    typed(console, "G10L20P1X0Y0Z0")
    load(console, WIDE)
    expect(console.page.get_by_text("Check passed")).to_be_visible()
    console.tab("control")
    typed(console, "G10L2P1X-200")
    console.tab("job")
    expect(console.page.get_by_text(re.compile("alarm 2"))).to_be_visible()  # checked again by itself
    refused(console, "lines are refused: the job will stop there.")


def test_without_soft_limits_the_travel_still_counts(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=(*SWITCHES, "$20=0"), speed=8.0)
    homed(console)
    typed(console, "G10L2P1X-200Y-100Z-50")
    load(console, WIDE)
    expect(console.page.get_by_text("X: the job does not fit the machine")).to_be_visible()
    refused(console, "X moves from -200.0 to 50.0 mm in machine coordinates; its travel is from -300.0 to 0.")
    console.clock(SLOW)
    console.by("job-start").click()
    console.by("start-anyway").click()
    expect(console.by("job-stop")).to_be_enabled()
    console.by("job-stop").click()
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()


# The page checks a job again when nothing has changed for 300 ms: never, here.
UNCHECKED = "() => { const later = setTimeout; window.setTimeout = (call, ms) => later(call, ms === 300 ? 1e8 : ms); }"


def test_a_check_of_another_zero_is_none(socket_link: Callable[..., Console]) -> None:
    """Between a change of the work zero and the next check, Start asks."""
    console = socket_link()
    console.page.evaluate(UNCHECKED)
    console.by("jog-X+").click()
    console.stands_at(X=1)
    load(console, WIDE)
    console.tab("control")
    console.page.get_by_role("button", name="Zero X").click()
    console.stands_at(X=0)
    console.tab("job")
    expect(console.by("job-time")).to_have_count(0)
    refused(console, "The preflight has not finished.")


def test_a_machine_that_was_not_homed(socket_link: Callable[..., Console]) -> None:
    """Its place is not known, its size is."""
    console = socket_link(speed=8.0)
    load(console, WIDE)
    expect(console.page.get_by_text("Check passed")).to_be_visible()
    expect(console.by("checked-with")).to_contain_text("X, Y, Z: not homed")
    expect(console.by("checked-with")).not_to_contain_text("did not accept")
    load(console, WIDE.replace("X250", "X350"))
    expect(console.page.get_by_text("X moves over 350.0 mm; its travel ($130) is 300.0 mm.")).to_be_visible()


def test_path_and_tool_have_one_zero(socket_link: Callable[..., Console]) -> None:
    """Work zero, in whichever system: path, bounds and tool are measured from it."""
    console = socket_link(speed=8.0)
    typed(console, "G0X20Y30Z10")
    typed(console, "G55")
    typed(console, "G10L20P2X1Y2Z3")
    typed(console, "G43.1Z2")
    load(console, "G21G90\nG0X0Y0Z5\nG1X10F1000\n")
    expect(path(console)).to_have_attribute("aria-label", re.compile(r"tool at X 1\.0, Y 2\.0, Z 1\.0$"))
    row = console.page.get_by_role("row").filter(has_text=re.compile("^X"))
    expect(row).to_contain_text("0.0010.00")
    console.by("job-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    expect(path(console)).to_have_attribute("aria-label", re.compile(r"tool at X 10\.0, Y 0\.0, Z 5\.0$"))


def test_modes_that_a_job_does_not_set_are_the_machines(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=8.0)
    typed(console, "G20G91F100")
    load(console, "G1X1\nX1\n")
    row = console.page.get_by_role("row").filter(has_text=re.compile("^X"))
    expect(row).to_contain_text("0.0050.80")  # two inches


def test_an_offset_of_g92(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=8.0)
    typed(console, "G0X20")
    typed(console, "G92X5")
    load(console, "G21G90\nG1X15F1000\n")
    row = console.page.get_by_role("row").filter(has_text=re.compile("^X"))
    expect(row).to_contain_text("5.0015.00")


def test_a_file_that_cannot_be_read_leaves_nothing_to_start(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    load(console, WIDE)
    console.by("job-file").set_input_files({"name": "empty.nc", "mimeType": "text/plain", "buffer": b"(nothing)\n"})
    expect(console.page.get_by_role("alert").filter(has_text="empty.nc has no G-code")).to_be_visible()
    expect(console.by("job-start")).to_have_count(0)
    expect(console.page.get_by_text("Drop a G-code file here")).to_be_visible()
