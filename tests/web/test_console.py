"""The console as a machinist uses it: by the WebSocket of `wificnc serve --http`, and by a serial port."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from console_page import SLOW, SWITCHES, Console, home, load, square, typed
from playwright.sync_api import Locator, expect
from web_fixture import Watched
from wificnc.connection.settings import read_file
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

# ---- by hand ----


def test_home_and_jog(link: Callable[..., Console]) -> None:
    three = ("$46=0", "$47=0", "$48=0")  # A, B and C have no switches in this test
    console = link(settings=("$22=1", "$25=3000", "$24=600", "$26=5", *three))
    for axis in "xyz":
        assert console.hands(f"travel {axis} -110 5") == "ok"
    console.by("home").click()
    console.is_in("Idle")
    # Each switch was met at its own place, and is left by $27 = 1 mm; the machine's zero is the switch.
    assert [console.position(axis) for axis in "XYZ"] == pytest.approx([-1.0] * 3, abs=0.02)
    console.page.get_by_role("button", name="Zero all").click()
    console.stands_at(X=0, Y=0, Z=0)
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.by("jog-X−").click()
    console.stands_at(X=-10)
    console.by("jog-Y−").click()
    console.stands_at(X=-10, Y=-10)


def test_jog_by_keyboard_and_while_held(link: Callable[..., Console]) -> None:
    console = link()
    console.page.get_by_label("Keyboard").check()
    expect(console.page.get_by_text("Arrow keys jog X and Y")).to_be_visible()
    console.page.keyboard.press("ArrowRight")
    console.stands_at(X=1)
    console.page.keyboard.press("PageDown")
    console.stands_at(X=1, Z=-1)
    console.page.get_by_role("button", name="while held").click()
    console.clock(SLOW)  # the page is in time with the next piece, so Idle is the end, and no pause between two
    console.page.keyboard.down("ArrowUp")
    console.is_in("Jog")
    expect(console.by("work-Y")).not_to_have_text("0.000")
    console.page.keyboard.up("ArrowUp")
    console.is_in("Idle")
    stopped = console.position("Y")
    assert 0.0 < stopped < 200.0, "it moved, and it stopped when the key went up"
    console.page.keyboard.press("Escape")
    assert console.position("Y") == stopped


def test_a_refused_jog_says_why(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=("$22=1", "$20=1"))
    console.by("unlock").click()
    console.is_in("Idle")
    console.page.get_by_role("button", name="100", exact=True).first.click()
    console.by("jog-X+").click()
    expect(console.page.get_by_role("alert").filter(has_text="the jog target is outside the travel")).to_be_visible()


def test_overrides_and_alarm(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=("$21=1",))
    console.page.get_by_label("Feed 10 % more").click()
    console.page.get_by_label("Feed 1 % less").click()
    console.page.get_by_label("Rapids 25 %").click()
    expect(console.by("override-feed")).to_have_text("109 %")
    assert console.hands("travel x -1 1000") == "ok"
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.by("jog-X−").click()
    expect(console.page.get_by_text("Alarm 1: a limit switch was hit")).to_be_visible()
    expect(console.page.get_by_text("It accepts no commands until it is reset")).to_be_visible()
    assert console.hands("travel x -1000 1000") == "ok"
    console.by("reset").click()
    console.by("unlock").click()
    console.is_in("Idle")


# ---- settings ----


def test_settings_round_trip(link: Callable[..., Console], tmp_path: Path) -> None:
    console = link()
    console.tab("settings")
    value = console.page.get_by_label("$110 max_rate_mm_min X")
    expect(value).to_have_value("6000.000")
    value.fill("-1")
    expect(console.by("settings-apply")).to_be_disabled()
    value.fill("4321.5")
    console.page.get_by_label("$11 junction_deviation_mm").fill("0.05")
    console.by("settings-apply").click()
    console.by("settings-send").click()
    expect(console.page.get_by_text("not applied yet")).to_have_count(0)
    with console.page.expect_download() as download:
        console.by("settings-export").click()
    exported = tmp_path / "settings.toml"
    download.value.save_as(exported)
    values = read_file(exported)  # our own reader, of `wificnc settings import`
    assert (float(values[110]), float(values[11])) == (4321.5, 0.05)
    text = exported.read_text().replace("4321.5", "1234.5").replace("soft_limits = false", "soft_limits = true")
    exported.write_text(text.replace("homing = false", "homing = true"))
    console.by("settings-file").set_input_files(exported)
    console.by("settings-apply").click()
    console.by("settings-send").click()
    expect(console.page.get_by_text("not applied yet")).to_have_count(0)
    expect(value).to_have_value("1234.500")
    # $20 asks for $22: both were taken, in the right order.
    assert [console.page.locator(f"[data-test=setting-{n}] input").is_checked() for n in (20, 22)] == [True, True]


def test_a_refused_setting_stays_an_edit(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("settings")
    console.page.locator("[data-test=setting-20] input").check()
    console.by("settings-apply").click()
    console.by("settings-send").click()
    expect(console.by("settings-refused")).to_contain_text("soft limits need homing")
    console.by("settings-close").click()
    expect(console.page.get_by_text("One setting is changed and not applied yet")).to_be_visible()


def test_measured_waves_become_settings(socket_link: Callable[..., Console]) -> None:
    """The numbers of docs/vibration.md, for Y."""
    console = socket_link()
    console.tab("settings")
    console.by("vibration-open").click()
    console.page.get_by_role("group", name="Axis that vibrates").get_by_role("button", name="Y").click()
    expect(console.by("vibration-missing")).to_contain_text("Enter the feed")
    for name, value in (("feed_mm_min", "2400"), ("waves", "8"), ("distance_mm", "7,75"), ("first", "12")):
        console.by(f"vibration-{name}").fill(value)
    expect(console.by("vibration-missing")).to_contain_text("both heights")
    console.by("vibration-last").fill("4")
    expect(console.by("vibration-found")).to_have_text("41.30 Hz, damping 0.022")
    expect(console.by("vibration-settings")).to_have_text("$171=2 $181=41.30 $191=0.022")
    console.page.get_by_role("radio", name="EI", exact=True).check()
    console.by("vibration-use").click()
    console.by("settings-apply").click()
    console.by("settings-send").click()
    expect(console.page.get_by_text("not applied yet")).to_have_count(0)
    for number, value in ((171, "3"), (181, "41.30"), (191, "0.022")):
        expect(console.page.locator(f"[data-test=setting-{number}] input")).to_have_value(value)


# ---- jobs ----


def test_a_whole_job_with_a_hold_in_the_middle(link: Callable[..., Console]) -> None:
    console = link()
    load(console, square(60))
    expect(console.page.get_by_text("Check passed")).to_be_visible()
    console.clock(SLOW)
    console.by("job-start").click()
    console.is_in("Run")
    console.by("hold").click()
    console.rests()
    console.clock(4)
    held = console.hands("state")
    assert held == console.hands("state"), "nothing moves in a hold"
    expect(console.by("job-lines")).not_to_have_text("243 of 243")
    console.by("resume").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    console.is_in("Idle")
    expect(console.by("job-lines")).to_have_text("243 of 243")
    console.tab("control")
    console.stands_at(X=0, Y=0, Z=-1)


def test_a_refused_line_stops_the_job_and_keeps_the_position(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    load(console, square(1).replace(" (round 0)", " W7", 1))
    expect(console.page.get_by_text(re.compile("Line 4: error 20"))).to_be_visible()
    console.by("job-start").click()
    console.by("start-anyway").click()
    expect(console.page.get_by_text("The job ended with an error")).to_be_visible()
    expect(console.page.get_by_text(re.compile(r"line 4 \(G1X1Y0F3000 W7\): error 20"))).to_be_visible()
    console.is_in("Idle")  # no alarm: it was held before it was reset


def test_stop(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    load(console, square(100))
    console.by("job-start").click()
    console.is_in("Run")
    console.by("job-stop").click()
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()
    console.is_in("Idle")


def test_the_link_is_lost_and_the_job_resumed(link: Callable[..., Console]) -> None:
    console = link()
    load(console, square(480))  # 48 s, of which the way to the slow clock needs one
    console.by("job-start").click()
    console.is_in("Run")
    console.clock(SLOW)  # what was sent lasts until the link is there again
    console.cut()
    expect(console.page.get_by_text("The connection was lost during the job")).to_be_visible()
    console.mend()
    expect(console.page.get_by_text(re.compile("Connected again after"))).to_be_visible()  # by itself
    expect(console.by("job-stop")).to_be_disabled()
    console.by("hold").click()  # where $74 lets it, what was sent continues by itself: hold it, and forget it
    console.clock(5)
    console.rests()
    console.by("reset").click()
    console.is_in("Idle")
    line = int(console.by("resume-line").input_value())
    console.by("resume-line").fill(str(max(4, line - 8)))
    console.by("resume-line").blur()
    console.by("resume-plan").click()
    preamble = console.by("resume-preamble").inner_text().splitlines()
    assert preamble[0] == "G21G90G94G17G54"
    assert preamble[1] == "G0Z1", "up to the highest place of the job before anything else"
    assert preamble[2:4] == ["M3S1000", "G4P4"]
    console.by("resume-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    console.is_in("Idle")
    console.tab("control")
    console.stands_at(X=0, Y=0, Z=-1)


# Four seconds of cutting in three lines: all are acknowledged before the first one is cut.
CUTS = "G21G90\nG1X20F300\nG1X21\nG1X22\n"


def test_done_is_what_was_cut_and_not_what_was_acknowledged(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    load(console, CUTS)
    console.by("job-start").click()
    console.is_in("Run")
    expect(console.page.get_by_label("Lines of the job")).to_contain_text("▸     2  G1X20F300")
    console.tab("terminal")
    expect(console.by("terminal")).not_to_contain_text("ok")
    console.tab("job")
    expect(console.by("job-lines")).to_have_text("1 of 4")  # four are answered, the second one is being cut
    expect(console.by("job-stop")).to_be_enabled()
    console.by("job-stop").click()
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()
    expect(console.by("resume-line")).to_have_value("2")
    console.tab("control")
    assert 0.0 < console.position("X") < 20.0


def test_a_job_runs_until_the_machine_rests(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    load(console, CUTS)
    console.by("job-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    console.is_in("Idle")
    expect(console.by("job-lines")).to_have_text("4 of 4")
    console.tab("control")
    console.stands_at(X=22)


WRITERS = ("Home", "Zero all", "Go to zero", "Zero X", "Zero Y", "Zero Z")


def writers(console: Console) -> list[Locator]:
    """Whatever puts a line between those of a job, on the tab Control."""
    buttons = [console.page.get_by_role("button", name=name, exact=True) for name in WRITERS]
    return [*buttons, console.page.get_by_label("Work system")]


def nothing_can_be_written(console: Console, why: str) -> None:
    console.tab("control")
    for writer in writers(console):
        expect(writer).to_be_disabled()
        expect(writer).to_have_accessible_description(why)
    expect(console.by("why-not")).to_have_text(why)
    for jog in ("jog-X−", "jog-Z−"):
        expect(console.by(jog)).to_be_disabled()
    console.tab("terminal")
    expect(console.by("terminal-line")).to_be_disabled()
    expect(console.by("terminal-line")).to_have_accessible_description(why)
    expect(console.page.get_by_role("button", name="Send")).to_be_disabled()
    console.tab("inout")
    expect(console.page.get_by_role("button", name="Flood")).to_be_disabled()
    console.tab("settings")
    expect(console.page.get_by_role("button", name="Restore defaults")).to_be_disabled()


def test_nothing_is_written_between_the_lines_of_a_job(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    load(console, CUTS)
    console.by("job-start").click()
    console.is_in("Run")
    nothing_can_be_written(console, "A job is running: stop it, or wait until it is finished.")
    console.by("hold").click()
    console.is_in("Hold")
    nothing_can_be_written(console, "A job is running: stop it, or wait until it is finished.")
    for byte in ("hold", "resume", "reset"):
        expect(console.by(byte)).to_be_enabled()
    console.tab("job")
    console.by("job-stop").click()
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()
    console.tab("control")
    for writer in writers(console):
        expect(writer).to_be_enabled()


def test_nothing_is_written_into_a_hold(socket_link: Callable[..., Console]) -> None:
    """It would wait there, and be carried out in the middle of what comes after."""
    console = socket_link(speed=SLOW)
    console.tab("terminal")
    console.by("terminal-line").fill("G1X20F300")
    console.by("terminal-line").press("Enter")
    console.is_in("Run")
    console.by("hold").click()
    console.is_in("Hold")
    nothing_can_be_written(console, "The machine is in a hold: press Resume, or Reset to discard the rest.")


# ---- the terminal ----


def test_a_comment_in_any_language_opens_no_door(link: Callable[..., Console]) -> None:
    console = link()
    typed(console, "G0 X1 (Ä ß ! ~ \u0085)")
    console.tab("control")
    console.stands_at(X=1)
    console.is_in("Idle")
    typed(console, "G0 X2Ä")
    expect(console.page.get_by_role("alert").filter(has_text='"Ä" is not ASCII')).to_be_visible()
    typed(console, "G0 X2!")
    expect(console.page.get_by_role("alert").filter(has_text='the command "feed hold"')).to_be_visible()
    typed(console, "$G")  # answered after whatever was sent before
    expect(console.by("terminal")).to_contain_text("[GC:")
    assert console.hands("state").startswith("position 1.0000,")
    console.clock(SLOW)
    typed(console, "G1X20F300")
    console.is_in("Run")
    typed(console, "!")
    console.is_in("Hold")


# ---- go to zero ----


def jog(console: Console, distance: str, *buttons: str, **axes: float) -> None:
    console.tab("control")
    console.page.get_by_role("button", name=distance, exact=True).first.click()
    for button in buttons:
        console.by(f"jog-{button}").click()
    console.stands_at(**axes)
    console.is_in("Idle")


def test_go_to_zero_of_a_homed_machine_stays_off_the_switches(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=SWITCHES, speed=4.0)
    home(console)
    jog(console, "100", "X−", "Y−", X=-102, Y=-102)
    jog(console, "10", "Z−", "Z−", Z=-22)
    console.page.get_by_role("button", name="Zero all").click()
    console.stands_at(X=0, Y=0, Z=0)
    jog(console, "10", "X−", "Y+", "Z−", X=-10, Y=10, Z=-10)
    console.by("go-to-zero").click()
    console.stands_at(X=0, Y=0, Z=20)
    console.is_in("Idle")  # $21 is on: a touch of the switch would be an alarm


def test_go_to_zero_refuses_what_is_outside(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=SWITCHES, speed=4.0)
    home(console)
    jog(console, "10", "X−", "Z−", X=-12, Z=-12)
    typed(console, "G10L20P0X-50")
    console.tab("control")
    console.stands_at(X=-50)
    console.by("go-to-zero").click()
    expect(console.page.get_by_role("alert").filter(has_text="Work zero of X is at 38.000 mm")).to_be_visible()
    console.stands_at(X=-50, Z=-12)


def test_go_to_zero_without_homing_asks_and_never_goes_down(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    jog(console, "10", "X+", "Z+", "Z+", X=10, Z=20)  # 20 above: the machine's own zero would be down
    console.by("go-to-zero").click()
    console.page.get_by_role("button", name="Cancel").click()
    console.stands_at(X=10, Z=20)
    console.by("go-to-zero").click()
    console.by("lift").fill("-3")
    expect(console.by("lift-go")).to_be_disabled()
    console.by("lift").fill("5")
    console.by("lift-go").click()
    console.stands_at(X=0, Y=0, Z=25)
    console.is_in("Idle")


# ---- several clients ----


def test_a_second_page_watches_and_takes_over(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    _, served = serve_page()
    context = watched()
    first = context.page(served.url)
    expect(first.locator("[data-test=resume]")).to_be_enabled()  # it is connected, and in control
    second = context.page(served.url)
    expect(second.get_by_text("View only")).to_be_visible()
    expect(second.locator("[data-test=resume]")).to_be_disabled()
    first.locator("[data-test='jog-X+']").click()
    expect(second.locator("[data-test=work-X]")).to_have_text("1.000")
    expect(second.locator("[data-test=state]")).to_have_text("Idle")  # of a machine at work it would ask
    second.locator("[data-test=take]").click()
    expect(first.get_by_text("View only")).to_be_visible()
    expect(second.locator("[data-test=resume]")).to_be_enabled()


def test_an_access_key_is_asked_for(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    _, served = serve_page(key="open sesame")
    page = watched().page(served.url)
    page.get_by_label("Access key").fill("a guess")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert").filter(has_text="This access key is not accepted")).to_be_visible()
    expect(page.locator("[data-test=resume]")).to_be_disabled()
    page.wait_for_timeout(1100)  # a wrong one costs a second, of the wall clock
    page.get_by_label("Access key").fill("open sesame")
    page.get_by_role("button", name="Log in").click()
    expect(page.locator("[data-test=resume]")).to_be_enabled()
    page.locator("[data-test='jog-X+']").click()
    expect(page.locator("[data-test=work-X]")).to_have_text("1.000")
    # the link of the QR code of `wificnc wifi status`
    second = watched().page(f"{served.url}#key=open%20sesame")
    expect(second.get_by_text("View only")).to_be_visible()  # logged in, and the first page is in control
    assert second.evaluate("location.href") == served.url
