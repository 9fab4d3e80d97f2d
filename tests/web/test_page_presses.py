"""A second press, a held key and a notice: nothing moves that was not meant.

The page's clock jumps between two presses (0.2, 0.6 and 2 s), so that no test waits for them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from itertools import product

import pytest
from console_page import SLOW, SWITCHES, Console, home, load, square
from patience import wait_until
from playwright.sync_api import Locator, WebSocket, expect
from slow import deep_but

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

SIZES = {"phone": (390, 844), "tablet": (820, 1180), "desktop": (1440, 900)}
LANGUAGES = ("en", "de", "es")
VIEWS = (("phone", "de"), ("tablet", "es"), ("desktop", "en"))
EVERY_VIEW = tuple(product(SIZES, LANGUAGES))
AGAIN_S = (0.2, 0.6, 2.0)
QUESTIONS = {"$I", "$$", "$#", "$G"}
TABS = ("control", "job", "guide", "inout")
LIMITED = ("$22=1", "$20=1")

# Name -> left, top, width and height of every control that moves the machine, on the page and not only in its window.
BOXES = """() => (scrollTo(0, 0), Object).fromEntries([...document.querySelectorAll("[data-machine]")]
    .filter((each) => !each.closest(".notices") && each.offsetWidth > 0)
    .map((each) => {
        const box = each.getBoundingClientRect();
        const place = [box.left, box.top + scrollY, box.width, box.height].map(Math.round);
        return [`${each.dataset.test ?? each.getAttribute("aria-label") ?? each.textContent}`, place];
    }))"""


class Hand:
    """A finger that presses places, whatever is there; and what the page sends."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.page = console.page
        self._frames: list[str] = []
        self.page.on("websocket", self._watch)
        self.page.clock.install()
        self.page.reload()
        expect(console.by("state")).not_to_have_text("Not connected")
        console.knows("G54")

    def _watch(self, socket: WebSocket) -> None:
        def sent(frame: str | bytes) -> None:
            self._frames.append(frame if isinstance(frame, str) else frame.decode("latin-1"))

        socket.on("framesent", sent)

    def look(self, size: str, language: str) -> None:
        width, height = SIZES[size]
        self.page.set_viewport_size({"width": width, "height": height})
        self.console.by("language").select_option(language)
        expect(self.page.locator("html")).to_have_attribute("lang", language)

    def place(self, test_id: str) -> tuple[float, float]:
        locator = self.console.by(test_id)
        locator.scroll_into_view_if_needed()
        expect(locator).to_be_enabled()
        box = locator.bounding_box()
        assert box, test_id
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def press(self, place: tuple[float, float]) -> None:
        self.page.mouse.click(*place)

    def later(self, seconds: float) -> None:
        if seconds >= 1:
            self._report()  # else the link would have been silent for too long
        self.page.clock.fast_forward(round(1000 * seconds))

    def _report(self) -> None:
        """The page asks for a report, and again when it has it."""
        asked = sum(frame.count("?") for frame in self._frames)
        wait_until(lambda: self._turn() and sum(frame.count("?") for frame in self._frames) > asked + 1, "a report")

    def sent(self) -> list[str]:
        """Since the last time, without questions."""
        self._report()
        text = "".join(self._frames).replace("?", "")
        self._frames.clear()
        return [line for line in text.split("\n") if line and line not in QUESTIONS]

    def _turn(self) -> bool:
        return bool(self.page.evaluate("new Promise((done) => requestAnimationFrame(() => done(true)))"))


@pytest.fixture
def hand(socket_link: Callable[..., Console]) -> Callable[..., Hand]:
    return lambda **options: Hand(socket_link(**options))


# ---- notices ----


def measured(hand: Hand, views: Collection[tuple[str, str]]) -> dict[tuple[str, str, str], dict[str, list[int]]]:
    """Every control in these sizes with their language, and in every tab."""
    found: dict[tuple[str, str, str], dict[str, list[int]]] = {}
    for size, language in views:
        hand.look(size, language)
        for tab in TABS:
            hand.console.tab(tab)
            hand.page.locator("#view [data-machine]").first.wait_for()
            found[size, language, tab] = hand.page.evaluate(BOXES)
    return found


@pytest.mark.parametrize("views", deep_but(VIEWS.__eq__, [VIEWS, EVERY_VIEW]), ids=["some views", "every view"])
def test_no_notice_moves_a_control(hand: Callable[..., Hand], views: Collection[tuple[str, str]]) -> None:
    """A refused line, a hold, a parked tool change, an alarm that waits for a reset; in all sizes and languages."""
    machine = hand(speed=0.5, settings=LIMITED)
    console = machine.console
    console.by("unlock").click()
    load(console, "G21G90\nG1X-5F300\nT1M6\nG1X-10\n", "tool.nc")
    console.tab("guide")
    machine.page.get_by_role("button", name="Homing").click()  # the step with Home and Reset
    before = measured(machine, views)
    assert {"jog-Z+", "home", "go-G28"} <= set(before["phone", "de", "control"])
    assert {"job-start", "job-stop"} <= set(before["phone", "de", "job"])
    assert "guide-home" in before["phone", "de", "guide"]

    def is_as_before(notice: Locator) -> None:
        expect(notice.first).to_be_visible()
        for where, boxes in measured(machine, views).items():
            assert boxes == before[where], where

    machine.look("desktop", "en")
    console.tab("control")
    console.by("jog-Z+").click()
    is_as_before(machine.page.locator(".notices .notice.bad"))
    machine.look("desktop", "en")
    console.tab("job")
    console.by("job-start").click()
    is_as_before(console.by("park"))
    console.by("park").click()
    is_as_before(machine.page.locator(".notices .notice.warn"))
    assert console.hands("estop on") == "ok"
    is_as_before(console.by("reset-alarm"))
    assert console.hands("estop off") == "ok"
    console.by("reset-alarm").click()
    expect(console.by("reset-alarm")).to_have_count(0)
    is_as_before(machine.page.locator(".notices"))


def test_taps_at_one_place_jog_one_way(hand: Callable[..., Hand]) -> None:
    """Where the jog is refused, with a notice; and where a notice with a button has been."""
    machine = hand(settings=LIMITED)
    machine.look(*VIEWS[0])
    unlock = machine.place("unlock")
    machine.sent()
    for s in (0, *AGAIN_S):
        machine.later(s)
        machine.press(unlock)
    assert set(machine.sent()) == {"$X"}  # more than one, where the answer has not come yet
    for size, language in VIEWS:
        machine.look(size, language)
        up = machine.place("jog-Z+")
        for s in (0, *AGAIN_S):
            machine.later(s)
            machine.press(up)
        assert machine.sent() == ["$J=G91G21Z1F1000"] * 4
        expect(machine.page.locator(".notices .notice.bad")).to_be_visible()


# A finger on a control in the frame in which it has appeared.
TOO_EARLY = """async () => {
    document.querySelector("#tab-job").click();
    await new Promise(requestAnimationFrame);
    document.querySelector("#tab-control").click();
    await new Promise(requestAnimationFrame);
    const jog = document.querySelector("[data-test='jog-X+']");
    const { left, top } = jog.getBoundingClientRect();
    const place = { clientX: left + 9, clientY: top + 9, button: 0, pointerId: 1, bubbles: true, cancelable: true };
    jog.dispatchEvent(new PointerEvent("pointerdown", place));
}"""
NOTES = {"en": "Not taken: this button", "de": "Nicht übernommen: Diese Taste", "es": "No aceptado: este botón"}


@pytest.mark.parametrize("view", deep_but(VIEWS[0].__eq__, VIEWS), ids="-".join)
def test_a_press_that_is_not_taken_is_shown(hand: Callable[..., Hand], view: tuple[str, str]) -> None:
    """Politely, over the page, and without a later effect."""
    machine = hand()
    machine.page.emulate_media(reduced_motion="reduce")
    machine.look(*view)
    before = machine.page.evaluate(BOXES)
    machine.sent()
    machine.page.evaluate(TOO_EARLY)
    note = machine.page.locator(".ignored-note")
    expect(note).to_contain_text(NOTES[view[1]])
    expect(note).to_have_attribute("role", "status")
    jog = machine.console.by("jog-X+")
    expect(jog).to_have_css("outline-style", "dashed")
    expect(jog).to_have_css("animation-name", "none")
    assert machine.page.evaluate(BOXES) == before
    box, width = note.bounding_box(), SIZES[view[0]][0]
    assert box and box["x"] >= 0 and box["x"] + box["width"] <= width
    expect(machine.page.locator(".notices .notice.bad")).to_have_count(0)
    machine.later(0.6)
    machine.later(2)
    expect(note).to_be_empty()
    expect(jog).not_to_have_css("outline-style", "dashed")
    assert machine.sent() == []


# ---- start and stop ----


def job(hand: Hand) -> None:
    load(hand.console, square(400))
    expect(hand.console.by("checked-with")).to_be_visible()  # of the machine as it is: else Start asks


def macro(hand: Hand) -> None:
    hand.console.tab("control")
    hand.console.by("macro-new").click()
    hand.console.by("macro-name").fill("Out")
    hand.console.by("macro-lines").fill("G21G91\n" + "G1X1F60\nG1X-1\n" * 20)
    hand.console.by("macro-save").click()


def outline(hand: Hand) -> None:
    load(hand.console, square(4, side=40))
    hand.console.by("frame").click()
    hand.console.by("frame-feed_mm_min").fill("60")


def warm(hand: Hand) -> None:
    hand.console.tab("control")
    hand.console.by("warm").click()


def probe(hand: Hand) -> None:
    hand.console.tab("control")
    hand.console.by("probe-plate").click()
    for state in ("on", "off"):
        assert hand.console.hands(f"probe {state}") == "ok"
        expect(hand.console.by("probe-test").locator(".on")).to_have_count(int(state == "on"))
    hand.console.by("probe-reach_mm").fill("100")


WAYS = {
    "job": (job, "job-start", "job-stop"),
    "macro": (macro, "macro-0", "macro-stop"),
    "outline": (outline, "frame-start", "frame-stop"),
    "warm-up": (warm, "warm-start", "warm-stop"),
    "probe": (probe, "probe-start", "probe-stop"),
}
STOPS = set("!\x18\x85")


def restart(hand: Hand, way: str) -> None:
    """By what starts it after it has ended."""
    if way != "job":
        hand.console.by(WAYS[way][1]).click()
        return
    expect(hand.console.by("job-start")).to_be_disabled()
    hand.console.by("run-again").click()
    hand.console.by("run-again-start").click()


@pytest.mark.parametrize("view", deep_but(VIEWS[0].__eq__, VIEWS), ids="-".join)
@pytest.mark.parametrize("way", WAYS)
def test_a_second_press_neither_stops_nor_starts(hand: Callable[..., Hand], way: str, view: tuple[str, str]) -> None:
    machine = hand(speed=SLOW if way != "warm-up" else 1.0)
    opens, start, stop = WAYS[way]
    machine.look(*view)
    opens(machine)
    for n, s in enumerate(AGAIN_S):
        at = machine.place(start) if n == 0 or way != "job" else None
        machine.sent()
        if at:
            for wait_s in (0.0, s, s):
                machine.later(wait_s)
                machine.press(at)
        else:
            restart(machine, way)
        expect(machine.console.by(stop)).to_be_enabled()
        sent = machine.sent()
        assert sent and not any(text.startswith(tuple("!\x18\x85")) for text in sent), f"again after {s} s"
        at = machine.place(stop)
        machine.press(at)
        machine.console.clock(5)
        expect(machine.console.by(start if way != "job" else "run-again")).to_be_enabled()
        machine.console.clock(SLOW if way != "warm-up" else 1.0)
        machine.sent()
        for wait_s in (s, s, s):
            machine.later(wait_s)
            machine.press(at)
        assert machine.sent() == [], f"again after {s} s"


def test_a_held_key_and_a_double_click_start_once(hand: Callable[..., Hand]) -> None:
    machine = hand(speed=SLOW)
    console = machine.console
    job(machine)
    machine.place("job-start")
    machine.sent()
    console.by("job-start").focus()
    for _ in range(12):
        machine.page.keyboard.down("Enter")  # again and again: event.repeat
    machine.page.keyboard.up("Enter")
    expect(console.by("job-stop")).to_be_enabled()
    assert not STOPS & set("".join(machine.sent()))
    console.by("job-stop").click()
    console.clock(5)
    expect(console.by("job-stop")).to_be_disabled()
    console.by("job-close").click()
    console.clock(SLOW)
    job(machine)
    at = machine.place("job-start")
    machine.sent()  # with what stopped the first job
    machine.page.mouse.dblclick(*at)
    expect(console.by("job-stop")).to_be_enabled()
    assert not STOPS & set("".join(machine.sent()))


# ---- held jogs ----


def test_each_held_button_jogs_when_another_one_was_let_go(hand: Callable[..., Hand]) -> None:
    machine = hand()
    console = machine.console
    machine.page.get_by_role("button", name="while held").click()
    for key, axis in (("jog-X+", "X"), ("jog-Y+", "Y"), ("jog-X−", "X"), ("jog-Z−", "Z")):
        was = console.position(axis)
        machine.page.mouse.move(*machine.place(key))
        machine.page.mouse.down()
        wait_until(lambda axis=axis, was=was: abs(console.position(axis) - was) > 8, key)
        machine.page.mouse.up()
        console.is_in("Idle")


def test_a_held_jog_ends_at_the_soft_limit(socket_link: Callable[..., Console]) -> None:
    console = socket_link(settings=(*SWITCHES, "$20=1"), speed=8.0)
    home(console)
    console.stands_at(Z=-2)
    console.clock(1)
    console.page.get_by_role("button", name="while held").click()
    console.by("jog-feed").fill("1000000000")
    console.by("jog-feed").blur()
    expect(console.by("jog-feed")).to_have_value("6000")
    expect(console.by("jog-Z+")).to_be_enabled()
    console.by("jog-Z+").hover()
    console.page.mouse.down()  # 2 mm, of which 0.3 s at this feed are 30 mm
    expect(console.page.get_by_text("End of the travel: Z+")).to_be_visible()
    nearest = -(0.01 + 1 / 80)  # as near as it comes, and a step
    wait_until(lambda: console.position("Z") >= nearest, "the end of the travel")  # letting go cancels what is left
    console.page.mouse.up()
    console.is_in("Idle")
    assert nearest <= console.position("Z") <= 0


def test_two_arrows_jog_diagonally_and_the_choice_outlives_a_tab(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.page.get_by_label("Keyboard").check()
    console.page.get_by_role("button", name="while held").click()
    console.tab("job")
    console.page.keyboard.press("ArrowUp")  # the list of tabs
    console.tab("control")
    expect(console.page.get_by_label("Keyboard")).to_be_checked()
    console.stands_at(X=0, Y=0)
    console.page.get_by_role("heading", name="Jog").click()
    console.page.keyboard.down("ArrowRight")
    console.page.keyboard.down("ArrowUp")
    wait_until(lambda: console.position("Y") > 5, "a jog")
    console.page.keyboard.up("ArrowRight")
    x = console.position("X")
    wait_until(lambda: console.position("Y") > 15, "a jog of the other key")
    assert console.position("X") < x + 3, "the key that is up does not jog"
    console.page.keyboard.up("ArrowUp")
    console.is_in("Idle")
