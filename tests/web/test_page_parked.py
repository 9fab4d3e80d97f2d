"""A job in a hold is the operator's for a while: jog, probe and zero by the page, and the return."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from console_page import SLOW, SWITCHES, Console, home, load, typed
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

CAM = "G21G90G0Z5\nT2 M6 (3 mm end mill)\nG0X1\nG1Z0F600\nX3\n"


def test_a_tool_is_changed_with_the_page(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    assert console.hands("surface -3") == "ok"
    load(console, CAM)
    console.by("job-start").click()
    console.is_in("Hold")
    expect(console.page.get_by_text("The program waits in line 2: T2 M6 (3 mm end mill)")).to_be_visible()
    expect(console.by("tool-steps").locator("li")).to_have_count(4)
    console.tab("control")
    expect(console.by("jog-Z+")).to_be_disabled()
    console.by("park").click()
    expect(console.page.get_by_text("Parked: fit tool T2")).to_be_visible()
    expect(console.by("home")).to_be_disabled()
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.by("jog-Z+").click()
    console.stands_at(X=0, Z=15)
    typed(console, "G91G38.2Z-40F1000")
    console.tab("control")
    expect(console.by("work-Z")).to_have_text(re.compile(r"^-3\.[01]"))  # and the way to stop
    console.page.get_by_role("button", name="Zero Z").click()
    console.stands_at(Z=0)
    console.by("jog-Z+").click()
    expect(console.by("work-Z")).to_have_text(re.compile(r"^10\.00"))  # steps are 0.0125 mm
    expect(console.by("resume")).to_have_accessible_description(re.compile("^Resume lifts Z .* crosses to where"))
    console.by("resume").click()
    console.is_in("Idle")
    console.stands_at(X=3)
    assert console.position("Z") == pytest.approx(0, abs=0.02)
    console.tab("job")
    expect(console.page.get_by_text("The job is finished")).to_be_visible()


def in_tool_change(socket_link: Callable[..., Console], way: int) -> Console:
    """It waits in Tool, which has no substate at rest."""
    console = socket_link(settings=(*SWITCHES, f"$341={way}"), speed=4.0)
    home(console)
    typed(console, "G10L2P9X-200Y-100Z-50")
    typed(console, "$#")  # a check that is made before the page knows it would be of another machine
    expect(console.page.get_by_text("[G59.3:-200.000,-100.000,-50.000")).to_be_visible()
    load(console, "G21G90G53G0X-20Z-20\nT2 M6 (3 mm end mill)\nG91G1X3F600\n")
    console.by("job-start").click()
    console.is_in("Tool")
    return console


def test_a_tool_change_that_lifts_z_is_operated_too(socket_link: Callable[..., Console]) -> None:
    console = in_tool_change(socket_link, 1)
    console.tab("control")
    expect(console.by("jog-Y−")).to_be_disabled()
    console.by("park").click()
    expect(console.page.get_by_text("Parked: fit tool T2")).to_be_visible()
    at = console.position("Y")
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.by("jog-Y−").click()
    expect(console.by("work-Y")).to_have_text(f"{at - 10:.3f}")
    expect(console.by("resume")).to_be_enabled()
    console.by("resume").click()
    console.is_in("Idle")
    assert [console.position(axis) for axis in "XYZ"] == pytest.approx([-17, at, -20], abs=0.02)
    console.tab("job")
    expect(console.page.get_by_text("The job is finished")).to_be_visible()


def test_a_tool_that_is_measured_is_not_asked_for_its_length(socket_link: Callable[..., Console]) -> None:
    console = in_tool_change(socket_link, 3)
    expect(console.by("tool-steps").locator("li").nth(2)).to_contain_text("is measured at the tool setter")


def test_a_return_that_is_refused_says_why(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=("$22=1", "$20=1", "$130=100", "$131=100", "$132=20"))
    console.by("unlock").click()
    console.is_in("Idle")
    console.clock(SLOW)
    typed(console, "G53G1X-50Y-50Z-2F3000")
    console.is_in("Run")
    console.by("hold").click()
    console.is_in("Hold")
    console.press("park")
    typed(console, "G43.1Z9")
    console.press("resume")
    refusal = console.page.get_by_role("alert").filter(has_text="with the new offsets the job leaves the travel")
    expect(refusal).to_be_visible()
    console.is_in("Hold")
    console.press("park")
    typed(console, "G49")
    console.tab("control")
    expect(refusal).to_have_count(0)
    console.press("resume")
    console.is_in("Run")
