"""Stored positions, macros, the laser's test and the spindle's warm-up, in the states in which they may arrive."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from console_page import SLOW, SWITCHES, Console, home, load, square, typed
from playwright.sync_api import Locator, expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
LASER = ("$32=1", "$30=1000", "$89=5", "$90=30")


def facts(console: Console) -> Locator:
    return console.page.locator(".facts").first


def accessible(console: Console) -> None:
    console.page.evaluate(AXE.read_text())
    found = console.page.evaluate("async () => (await axe.run()).violations.map((v) => v.id + ': ' + v.nodes[0].html)")
    assert found == []


def make_macro(console: Console, name: str, lines: str) -> None:
    console.by("macro-new").click()
    console.by("macro-name").fill(name)
    console.by("macro-lines").fill(lines)
    console.by("macro-save").click()


def test_a_stored_position_is_set_and_reached_with_z_up(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=5.0, settings=SWITCHES)
    home(console)
    typed(console, "$J=G53G21G90X-100Y-50Z-30F3000")
    console.tab("control")
    console.stands_at(X=-100, Y=-50, Z=-30)
    console.is_in("Idle")
    console.by("set-G28").click()
    console.by("store-G28").click()
    typed(console, "$J=G53G21G90X-20Y-20Z-60F3000")
    console.tab("control")
    console.stands_at(X=-20, Y=-20, Z=-60)
    console.is_in("Idle")
    console.by("go-G28").click()
    console.stands_at(X=-100, Y=-50, Z=-30)
    console.tab("terminal")
    expect(console.by("terminal")).to_contain_text("$J=G53G21G90Z-2F6000")  # 2 mm ($27) below the switch
    console.tab("control")
    console.by("go-G30").click()
    expect(console.page.get_by_text("No position is stored for G30")).to_be_visible()
    accessible(console)


def test_positions_of_a_machine_that_was_not_homed_are_refused(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    expect(console.by("set-G28")).to_be_disabled()
    console.by("go-G28").click()
    expect(console.page.get_by_text("Home the machine first")).to_be_visible()
    console.stands_at(X=0, Y=0, Z=0)


def test_a_macro_runs_is_kept_changed_and_deleted(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    make_macro(console, "Out", "G21G91 (relative)\nG1 X2 F3000\nG1 Y1\nG90")
    console.by("macro-0").click()
    console.stands_at(X=2, Y=1, Z=0)
    console.page.reload()
    console.is_in("Idle")
    expect(console.by("macro-0")).to_have_text("Out")
    console.by("macro-edit-0").click()
    console.by("macro-lines").fill("G0X5\n!\n")
    expect(console.by("macro-save")).to_be_disabled()
    console.by("macro-lines").fill("G1X5F1000\nG1X0R3\nG1X9")
    accessible(console)
    console.page.screenshot(path="build/tests/macro-dialog.png")
    console.by("macro-save").click()
    console.by("macro-0").click()
    expect(console.page.get_by_role("alert").filter(has_text="G1X0R3: error")).to_be_visible()
    console.stands_at(X=5, Y=1)  # the line that was refused, and those after it, did nothing
    console.by("macro-edit-0").click()
    console.by("macro-delete").click()
    expect(console.by("macro-0")).to_have_count(0)


def test_macros_are_refused_while_a_job_runs_and_no_job_starts_in_one(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    make_macro(console, "Out", "G21G90G1X30F600\nG1X0")
    make_macro(console, "Mist", "M8")
    load(console, square(30))
    console.by("job-start").click()
    console.is_in("Run")
    console.tab("control")
    for n in range(2):
        expect(console.by(f"macro-{n}")).to_be_disabled()
        expect(console.by(f"macro-{n}")).to_have_attribute(
            "title", "A job is running: stop it, or wait until it is finished."
        )
    for test_id in ("go-G28", "warm"):
        expect(console.by(test_id)).to_be_disabled()
    console.tab("job")
    console.by("job-stop").click()
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()
    console.tab("control")
    console.by("macro-0").click()
    console.is_in("Run")
    console.tab("job")
    expect(console.by("job-start")).to_be_disabled()
    console.tab("control")
    console.page.screenshot(path="build/tests/macro-runs.png", full_page=True)
    console.by("macro-stop").click()
    console.clock(5)
    console.is_in("Idle")
    expect(console.by("macro-0")).to_be_enabled()
    assert 0 < console.position("X") < 30


def test_the_laser_is_lit_only_while_the_button_is_held(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=LASER)
    page = console.page
    page.clock.install()  # before the page measures time: its clock must not go back
    page.reload()
    console.is_in("Idle")
    console.knows("G54")
    console.by("fire").click()
    console.by("fire-power_pct").fill("6")
    expect(console.by("fire-hold")).to_be_disabled()
    expect(console.by("fire-why")).to_contain_text("at most 5 %")
    console.by("fire-power_pct").fill("3")
    accessible(console)
    console.by("fire-time_s").fill("10")
    for end in ("up", "blur", "pagehide", "limit"):
        expect(console.by("fire-hold")).to_be_enabled()
        console.by("fire-hold").hover()
        page.mouse.down()
        expect(facts(console)).to_contain_text("30 rpm")
        if end == "up":
            page.screenshot(path="build/tests/fire.png")
            page.mouse.up()
        elif end == "limit":
            page.clock.fast_forward(10_000)
        else:
            page.evaluate("name => window.dispatchEvent(new Event(name))", end)
        expect(facts(console)).to_contain_text("Spindle0 rpm")
        expect(console.by("fire-hold")).to_have_text("Hold to light")
        page.mouse.up()
    page.get_by_role("button", name="Close").last.click()
    expect(facts(console)).to_contain_text("G0 ")
    expect(facts(console)).to_contain_text("M5")


def test_the_beam_ends_with_the_link_and_the_dialog(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=LASER)
    console.by("fire").click()
    console.by("fire-time_s").fill("10")
    expect(console.by("fire-hold")).to_be_enabled()
    console.by("fire-hold").focus()
    console.page.keyboard.down(" ")
    expect(facts(console)).to_contain_text("10 rpm")
    console.page.keyboard.press("Escape")
    expect(console.by("fire-hold")).to_have_count(0)
    expect(facts(console)).to_contain_text("M5")
    expect(facts(console)).to_contain_text("Spindle0 rpm")  # the report follows the modes
    console.page.keyboard.up(" ")
    console.by("fire").click()
    console.by("fire-time_s").fill("10")  # a new dialog: 2 s could be over before the link is cut
    expect(console.by("fire-hold")).to_be_enabled()
    console.by("fire-hold").hover()
    console.page.mouse.down()
    expect(facts(console)).to_contain_text("10 rpm")
    console.cut()
    expect(console.by("fire-hold")).to_have_text("Hold to light")
    expect(console.by("fire-hold")).to_be_disabled()
    console.page.mouse.up()
    console.mend()
    console.is_in("Hold")  # $74: idle, with a laser on
    expect(facts(console)).to_contain_text("Spindle0 rpm")


def test_no_laser_without_its_settings(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=("$32=1",))
    console.by("fire").click()
    expect(console.by("fire-why")).to_contain_text("$89")
    expect(console.by("fire-hold")).to_be_disabled()


def test_a_spindle_is_warmed_up_and_stopped(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    expect(console.by("fire")).to_have_count(0)  # $32=0: this would turn the spindle
    console.by("warm").click()
    accessible(console)
    for n, rpm in enumerate((200, 400, 600)):
        console.by(f"warm-rpm-{n}").fill(str(rpm))
        console.by(f"warm-time_s-{n}").fill("600" if n == 2 else "0.1")
    console.by("warm-start").click()
    expect(facts(console)).to_contain_text("600 rpm")
    console.page.screenshot(path="build/tests/warm.png")
    console.by("warm-stop").click()
    expect(facts(console)).to_contain_text("Spindle0 rpm")
    console.knows("M5")
    console.by("warm-start").click()
    expect(facts(console)).to_contain_text("600 rpm")
    console.page.keyboard.press("Escape")
    expect(facts(console)).to_contain_text("Spindle0 rpm")
    console.knows("M5")
    console.is_in("Idle")


def test_it_fits_a_phone(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=LASER)
    console.page.set_viewport_size({"width": 390, "height": 844})
    for name in ("Park", "Touch plate", "Mist on"):
        make_macro(console, name, "M8")
    assert console.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    console.page.screenshot(path="build/tests/shortcuts-phone.png", full_page=True)
