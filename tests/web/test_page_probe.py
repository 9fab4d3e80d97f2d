"""The probing dialogs against a machine whose probe touches at a height."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from console_page import SLOW, Console, load, typed
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


def test_z_is_probed_shown_and_undone(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    typed(console, "G20G91")  # its modes are the program's again afterwards
    console.tab("control")
    expect(console.page.locator(".facts")).to_contain_text("G91")
    console.by("probe-plate").click()
    start = console.by("probe-start")
    expect(start).to_be_disabled()
    expect(start).to_have_accessible_description("Test the probe first.")
    console.by("probe-thickness_mm").fill("10.5")
    expect(console.by("probe-lines")).to_contain_text("G21G91G94G38.3Z-20F150\n$J=G21G91Z2F150")
    assert console.hands("probe on") == "ok"
    expect(console.by("probe-test")).to_contain_text("In contact")
    expect(start).to_be_disabled()
    assert console.hands("probe off") == "ok"
    assert console.hands("surface -3") == "ok"
    start.click()
    expect(console.page.get_by_text("Work zero of Z is set in G54")).to_be_visible()
    assert console.position("Z") == pytest.approx(10.5 + 2 + 6, abs=0.02)  # off the plate, and lifted
    console.by("probe-undo").click()
    expect(console.page.get_by_text("The work zero of before is back.")).to_be_visible()
    expect(console.by("work-Z")).to_have_text(re.compile(r"^(4\.99|5\.0)"))  # -3 + 2 + 6
    console.by("probe-close").click()
    expect(console.page.locator(".facts")).to_contain_text("G20 G91")


def test_a_probe_that_finds_nothing_sets_nothing_and_can_be_stopped(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.by("probe-plate").click()
    for state in ("on", "off"):
        assert console.hands(f"probe {state}") == "ok"
        expect(console.by("probe-test")).to_contain_text("In contact" if state == "on" else "The probe works")
    console.by("probe-reach_mm").fill("1")
    console.by("probe-start").click()
    expect(console.page.get_by_text("The probe found nothing on its way along Z")).to_be_visible()
    console.is_in("Idle")
    console.clock(SLOW)
    console.by("probe-reach_mm").fill("100")
    console.by("probe-start").click()
    console.is_in("Run")
    console.by("probe-stop").click()
    expect(console.page.get_by_text("Stopped by hand.")).to_be_visible()
    console.is_in("Idle")
    assert -5.0 < console.position("Z") < -1.0


def probe_tested(console: Console) -> None:
    for state in ("on", "off"):
        assert console.hands(f"probe {state}") == "ok"
        expect(console.by("probe-test")).to_contain_text("In contact" if state == "on" else "The probe works")


def test_a_tool_length_is_measured_against_the_reference_and_undone(socket_link: Callable[..., Console]) -> None:
    """The second tool touches 1.5 mm earlier: work zero stays that of the first one."""
    console = socket_link(speed=4.0)
    console.by("probe-length").click()
    probe_tested(console)
    assert console.hands("surface -5") == "ok"
    console.by("probe-start").click()
    expect(console.page.get_by_text("This tool is the reference")).to_be_visible()
    expect(console.by("work-Z")).to_have_text(re.compile(r"^(2\.99|3\.0)"))  # -5 + 2 + 6
    console.by("probe-close").click()
    console.by("probe-length").click()
    assert console.hands("probe on") == "ok"
    expect(console.by("probe-test")).to_contain_text("In contact")
    assert console.hands("probe off") == "ok"
    expect(console.by("probe-test")).to_contain_text("The probe works")
    assert console.hands("surface -3.5") == "ok"
    console.by("probe-start").click()
    expect(console.page.get_by_text(re.compile(r"The tool length is 1\.(49|50)"))).to_be_visible()
    console.page.screenshot(path="build/tests/probe-length.png")
    expect(console.by("work-Z")).to_have_text(re.compile(r"^(2\.99|3\.0)"))
    console.by("probe-undo").click()
    expect(console.page.get_by_text("The tool length of before is back.")).to_be_visible()
    expect(console.by("work-Z")).to_have_text(re.compile(r"^4\.(49|5)"))
    console.by("probe-close").click()


def test_an_edge_that_is_not_found_measures_no_rotation(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.by("probe-rotation").click()
    probe_tested(console)
    console.by("probe-reach_mm").fill("1")
    expect(console.by("probe-lines")).to_contain_text("G21G91G94G38.3Y40F300")
    console.page.screenshot(path="build/tests/probe-rotation.png")
    console.by("probe-start").click()
    expect(console.page.get_by_text("The probe found nothing on its way along X")).to_be_visible()


PROBE_SLOW = 0.2  # of real time: a jog of 2 mm takes 4 s


def test_a_cycle_ends_when_its_jog_is_stopped_at_the_machine(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    console.by("probe-plate").click()
    probe_tested(console)
    assert console.hands("surface -1") == "ok"
    console.clock(PROBE_SLOW)
    console.by("probe-start").click()
    console.is_in("Jog")
    assert console.hands("hold") == "ok"
    expect(console.page.get_by_text("Stopped by another client or at the machine")).to_be_visible()
    expect(console.page.get_by_text("The work zero is as before: nothing was set.")).to_be_visible()
    console.is_in("Idle")
    expect(console.by("probe-start")).to_be_enabled()


def test_a_cycle_ends_when_the_parked_job_is_resumed(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    load(console, "G21G90\nM0\nG1X2F600\n")
    console.by("job-start").click()
    console.is_in("Hold")
    console.by("park").click()
    expect(console.page.get_by_text("Parked: the job waits for Resume")).to_be_visible()
    console.tab("control")
    console.by("probe-plate").click()
    probe_tested(console)
    assert console.hands("surface -1") == "ok"
    console.by("probe-start").click()
    expect(console.by("probe-stop")).to_be_enabled()
    assert console.hands("start") == "ok"
    expect(console.page.get_by_text("The job was resumed at the machine or by another client")).to_be_visible()
    console.is_in("Idle")
    console.page.keyboard.press("Escape")
    console.stands_at(X=2, Z=0)


def test_a_cycle_that_is_stopped_leaves_work_system_and_tool_length(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    typed(console, "G55G20G43.1Z0.5")
    console.tab("control")
    console.knows("G55", "G20")
    console.by("probe-plate").click()
    probe_tested(console)
    console.clock(SLOW)
    console.by("probe-start").click()
    console.is_in("Run")
    console.by("probe-stop").click()
    expect(console.page.get_by_text("Stopped by hand.")).to_be_visible()
    console.clock(1.0)
    console.page.keyboard.press("Escape")
    console.knows("G55", "G20", "G90")
    typed(console, "$#")
    expect(console.by("terminal")).to_contain_text("[TLO:12.700]")
