"""What the page knows of a controller is true, also of one that it has met in the middle of a job."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from console_page import SLOW, Console, hands_say, load, typed
from patience import HANG_S
from playwright.sync_api import expect
from web_fixture import Watched
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


class Sender:
    """A text client by TCP."""

    def __init__(self, server: Server) -> None:
        host, _, port = (server.tcp or "").rpartition(":")
        self.socket = socket.create_connection((host, int(port)), HANG_S)
        self.file = self.socket.makefile("rb")

    def __enter__(self) -> Sender:
        return self

    def __exit__(self, *_error: object) -> None:
        self.file.close()
        self.socket.close()

    def send(self, line: str) -> None:
        self.socket.sendall(line.encode() + b"\n")

    def until(self, text: str) -> None:
        while text not in (line := self.file.readline().decode()):
            assert line, "the connection was closed"


@pytest.fixture
def senders() -> Iterator[Callable[[Server], Sender]]:
    """Connect another client; the first one that sends a line is in control."""
    with ExitStack() as stack:
        yield lambda server: stack.enter_context(Sender(server))


def test_a_work_system_of_the_terminal_is_the_one_that_zero_sets(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    typed(console, "G55")
    console.tab("control")
    expect(console.page.get_by_label("Work system")).to_have_value("G55")
    console.by("jog-X+").click()
    console.stands_at(X=1)
    console.page.get_by_role("button", name="Zero X", exact=True).click()
    console.stands_at(X=0)
    typed(console, "G54")
    console.tab("control")
    expect(console.page.get_by_label("Work system")).to_have_value("G54")
    console.stands_at(X=1)


def test_the_work_system_that_a_job_leaves(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    load(console, "G21G90\nG56\nG0X1\n")
    console.by("job-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    console.tab("control")
    expect(console.page.get_by_label("Work system")).to_have_value("G56")


def test_a_job_that_names_no_work_system_is_resumed_in_its_own(socket_link: Callable[..., Console]) -> None:
    """Its stop leaves G54 and no tool length."""
    console = socket_link()
    typed(console, "G10L2P2X50")
    typed(console, "G55G43.1Z3.2")
    console.tab("control")
    console.knows("G55")
    load(console, "G21G90\nG1X20F600\nX30\n")
    console.clock(SLOW)
    console.by("job-start").click()
    console.is_in("Run")
    console.by("job-stop").click()
    console.clock(1.0)
    expect(console.page.get_by_text("The job was stopped")).to_be_visible()
    console.is_in("Idle")
    console.by("run-again").click()
    dialog = console.page.get_by_role("dialog")
    expect(dialog).to_contain_text("The job ran in G55, and the machine is in G54 now.")
    expect(dialog).to_contain_text("The tool length of the job (3.200) is not in force any more")
    dialog.get_by_role("button", name="Cancel").click()
    console.by("resume-plan").click()
    expect(console.by("resume-preamble")).to_contain_text("G21G90G94G17G55")
    expect(dialog).to_contain_text("The tool length of the job (3.200) is not in force any more")


def test_a_setting_of_the_terminal_is_seen_by_the_settings(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    typed(console, "$110=4321")
    console.tab("settings")
    expect(console.page.locator("[data-test=setting-110] input")).to_have_value("4321.000")


def test_questions_in_the_terminal_show_their_answers(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    typed(console, "$$")
    expect(console.by("terminal")).to_contain_text("$110=6000.000")
    typed(console, "?")
    expect(console.by("terminal")).to_contain_text("<Idle|MPos:")
    typed(console, "G0X0F77")
    console.tab("control")
    console.knows("F77")
    console.tab("terminal")
    expect(console.by("terminal").get_by_text("ok", exact=True)).to_have_count(2)
    expect(console.by("terminal")).not_to_contain_text("[GC:")  # the page's own questions are not in it
    console.by("terminal-line").press("ArrowUp")
    expect(console.by("terminal-line")).to_have_value("G0X0F77")


def test_settings_of_a_machine_that_was_met_in_a_job(
    serve_page: Callable[..., tuple[Server, PageServer]],
    watched: Callable[..., Watched],
    senders: Callable[[Server], Sender],
) -> None:
    """They are not answered while it moves, and asked for when it rests."""
    server, served = serve_page(speed=SLOW)
    sender = senders(server)
    sender.send("G21G91G1X3F6")  # ten minutes at this speed: longer than any computer takes to open a page
    sender.until("ok")
    page = watched().page(served.url)
    expect(page.locator("[data-test=state]")).to_have_text("Run")
    page.locator("[data-test=take]").click()
    page.locator("[data-test=take-anyway]").click()
    expect(page.locator("[data-test=state]")).to_have_text("Hold")
    page.locator("[data-test=resume]").click()
    expect(page.locator("[data-test=state]")).to_have_text("Run")
    assert hands_say(server, "speed 4") == "ok"
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    page.click("#tab-settings")
    expect(page.locator("[data-test=setting-110]")).to_be_visible()
    page.click("#tab-control")
    expect(page.get_by_text("G91")).to_be_visible()


# ---- who is there ----


def test_an_observer_can_hold(
    serve_page: Callable[..., tuple[Server, PageServer]],
    watched: Callable[..., Watched],
    senders: Callable[[Server], Sender],
) -> None:
    server, served = serve_page()
    sender = senders(server)
    sender.send("G21G91G1X100F60")
    sender.until("ok")
    page = watched().page(served.url)
    expect(page.get_by_text("View only")).to_be_visible()
    page.locator("[data-test=hold]").click()
    expect(page.locator("[data-test=state]")).to_have_text("Hold")
    expect(page.locator("[data-test=resume]")).to_be_disabled()
    page.locator("[data-test=reset]").click()  # behind its own hold
    expect(page.locator("[data-test=state]")).to_have_text("Idle")


def test_leaving_a_machine_at_work_is_asked_for(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    typed(console, "G21G91G1X10F300")
    console.is_in("Run")
    console.by("disconnect").click()
    expect(console.page.get_by_role("dialog")).to_contain_text("It slows down to a feed hold")
    console.page.get_by_role("button", name="Stay connected").click()
    console.is_in("Run")
    console.by("disconnect").click()
    console.by("disconnect-anyway").click()
    expect(console.by("state")).to_have_text("Not connected")
    assert console.hands("state") != ""


def test_an_idle_machine_is_left_without_a_question(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.by("disconnect").click()
    expect(console.by("state")).to_have_text("Not connected")


def test_a_controller_that_someone_else_has_reset_says_so(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    _, served = serve_page()
    context = watched()
    first = context.page(served.url)
    expect(first.locator("[data-test=resume]")).to_be_enabled()  # it is connected, and in control
    second = context.page(served.url)
    expect(second.get_by_text("View only")).to_be_visible()
    first.locator("[data-test=hold]").click()
    expect(first.locator("[data-test=state]")).to_have_text("Hold")
    first.locator("[data-test=reset]").click()
    expect(second.get_by_text("The controller has started again")).to_be_visible()
    expect(first.locator("[data-test=state]")).to_have_text("Idle")  # it has heard of it, too
    expect(first.get_by_text("The controller has started again")).to_have_count(0)
    second.get_by_role("button", name="Close").click()
    expect(second.get_by_text("The controller has started again")).to_have_count(0)


def test_a_lost_link_comes_back_by_itself_and_nothing_continues(link: Callable[..., Console]) -> None:
    console = link(speed=SLOW)
    typed(console, "G21G91G1X2F60")
    console.is_in("Run")
    console.cut()
    expect(console.page.get_by_text("Trying to connect again.")).to_be_visible()
    console.mend()
    expect(console.page.get_by_text("Connected again after")).to_be_visible()
    expect(console.by("resume")).to_be_enabled()
