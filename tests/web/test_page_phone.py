"""The page in a hand: where things stand on a phone, in the longest words, and what fingers do; and the units."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from console_page import SLOW, Console, load, square, typed
from playwright.sync_api import Locator, Page, expect
from test_page_drives import settings_tab
from test_screens import LOOKS, ROOT, TABS
from web_fixture import Watched
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

Serve = Callable[..., tuple[Server, PageServer]]
Point = tuple[float, float]
INCHES = ("$13=1",)

# Elements that reach out of their card, but for those that scroll in it and those that only readers hear.
OUTSIDE = """() => [...document.querySelectorAll(".card")].flatMap((card) => {
    const right = card.getBoundingClientRect().right;
    return [...card.querySelectorAll("*")]
        .filter((each) => !each.closest(".scroll, .path, .terminal, svg") && each.getBoundingClientRect().width > 1)
        .filter((each) => each.getBoundingClientRect().right > right + 0.5)
        .map((each) => `${each.tagName} ${each.textContent.trim().slice(0, 40)}`);
})"""

# Centre of the dots of a colour on the path's canvas, in pixels of the page from the canvas' middle.
CENTRE = """([red, green, blue]) => {
    const canvas = document.querySelector(".path canvas");
    const { width, height } = canvas;
    const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
    let [x, y, count] = [0, 0, 0];
    for (let at = 0; at < data.length; at += 4)
        if (Math.abs(data[at] - red) + Math.abs(data[at + 1] - green) + Math.abs(data[at + 2] - blue) < 12) {
            x += (at / 4) % width;
            y += Math.floor(at / 4 / width);
            count++;
        }
    const scale = canvas.getBoundingClientRect().width / width;
    return count ? [(x / count - width / 2) * scale, (y / count - height / 2) * scale] : null;
}"""


@pytest.fixture
def phone(serve_page: Serve, watched: Callable[..., Watched]) -> Iterator[Page]:
    """A six-axis machine in German, which has the longest words."""
    _, served = serve_page()
    page = watched(reduced_motion="reduce", locale="de-DE", **LOOKS["phone"]).page(served.url)
    expect(page.locator("[data-test='jog-X+']")).to_be_enabled()
    expect(page.locator(".facts").first).to_contain_text("G54")  # the last question: a job is checked, and drawn, once
    yield page


def box(locator: Locator) -> dict[str, float]:
    found = locator.bounding_box()
    assert found
    return dict(found)


def with_path(page: Page) -> None:
    page.click("#tab-job")
    page.locator("[data-test=job-file]").set_input_files(ROOT / "examples" / "pcb_outline.nc")
    expect(page.locator("[data-test=job-time]")).to_be_visible()
    page.locator(".path canvas").scroll_into_view_if_needed()


def end_of_path(page: Page) -> Point:
    """The mark of the end, as it is drawn."""
    page.wait_for_function(CENTRE, arg=END)
    x, y = page.evaluate(CENTRE, END)
    return x, y


def colour(page: Page) -> list[int]:
    """Of the mark in the legend."""
    text = page.evaluate("getComputedStyle(document.querySelector('.legend .end'), '::before').backgroundColor")
    return [int(part) for part in text.partition("(")[2].rstrip(")").split(",")[:3]]


END = [186, 32, 32]


def test_the_pad_comes_before_the_rows_of_the_axes(phone: Page) -> None:
    """Whole, above the bar with Hold, without scrolling."""
    bar = box(phone.locator(".safety"))
    for name in ("jog-Y+", "jog-X−", "jog-Z−"):
        key = box(phone.locator(f"[data-test='{name}']"))
        assert key["y"] + key["height"] < bar["y"], name
        assert key["y"] < box(phone.locator("[data-test=work-X]"))["y"], name
    row = box(phone.locator("[data-test=work-X]"))
    assert row["y"] + row["height"] < bar["y"], "the axis that is jogged can be seen"


def test_nothing_reaches_out_of_its_card(phone: Page) -> None:
    with_path(phone)
    found: list[str] = []
    for tab in ("guide", *TABS):
        phone.click(f"#tab-{tab}")
        expect(phone.locator(".card").first).to_be_visible()
        found += [f"{tab}: {what}" for what in phone.evaluate(OUTSIDE)]
    assert found == []


# Width of the screen, and size of the text, %: half of a small desktop at 400 %, a phone, and the text twice as large.
SIZES = {(320, 100): 640, (360, 130): 740, (390, 200): 844}
LANGUAGES = ("de", "es", "en")
# How much wider than the screen the page is; and what stops the machine, if anything lies over it.
SCROLLS = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
COVERED = """() => ["hold", "resume", "reset"].filter((name) => {
    const button = document.querySelector(`[data-test=${name}]`);
    const { left, right, top, bottom } = button.getBoundingClientRect();
    const corners = [[left + 6, top + 6], [right - 6, top + 6], [left + 6, bottom - 6], [right - 6, bottom - 6]];
    const isCut = button.scrollWidth > button.clientWidth + 1 || button.scrollHeight > button.clientHeight + 1;
    return isCut || corners.some((at) => !button.contains(document.elementFromPoint(...at)));
})"""


@pytest.mark.parametrize("size", SIZES, ids="{0[0]}px-{0[1]}%".format)
def test_large_text_needs_no_scrolling_sideways(phone: Page, size: tuple[int, int]) -> None:
    """WCAG 1.4.4 and 1.4.10, in every tab and language; Hold, Resume and Reset are whole and free."""
    with_path(phone)
    width, percent = size
    phone.set_viewport_size({"width": width, "height": SIZES[size]})
    phone.evaluate("percent => document.documentElement.style.fontSize = `${percent}%`", percent)
    found = []
    for language in LANGUAGES:
        phone.locator("[data-test=language]").select_option(language)
        expect(phone.locator("html")).to_have_attribute("lang", language)
        for tab in ("guide", *TABS):
            phone.locator(f"#tab-{tab}").evaluate("tab => tab.click()")
            expect(phone.locator(f"#tab-{tab}")).to_have_attribute("aria-selected", "true")
            expect(phone.locator(".card").first).to_be_visible()
            if wide := phone.evaluate(SCROLLS):
                found.append(f"{language} {tab}: {wide} px too wide")
            found += [f"{language} {tab}: {name} is covered" for name in phone.evaluate(COVERED)]
    assert found == []


def test_the_legend_and_the_switch_lie_beside_each_other(phone: Page) -> None:
    with_path(phone)
    legend, switch, canvas = (box(phone.locator(f".path {name}")) for name in (".legend", ".segments", "canvas"))
    assert legend["y"] >= switch["y"] + switch["height"]
    assert canvas["y"] >= legend["y"] + legend["height"]


def test_two_fingers_zoom_the_path_and_one_moves_it(phone: Page) -> None:
    with_path(phone)
    END[:] = colour(phone)
    canvas = box(phone.locator(".path canvas"))
    middle = (canvas["x"] + canvas["width"] / 2, canvas["y"] + canvas["height"] / 2)
    before = end_of_path(phone)
    fingers = phone.context.new_cdp_session(phone)

    def touch(kind: str, *places: Point) -> None:
        points = [{"x": middle[0] + x, "y": middle[1] + y, "id": i} for i, (x, y) in enumerate(places)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def drawn_at(place: Point) -> None:
        near = f"([c, x, y]) => {{ const at = ({CENTRE})(c); return at && Math.hypot(at[0] - x, at[1] - y) < 3; }}"
        phone.wait_for_function(near, arg=[END, *place])

    touch("touchStart", (0, 0))
    for step in (1, 2, 3, 4):
        touch("touchMove", (20 * step, -15 * step))
    touch("touchEnd")
    moved = (before[0] + 80, before[1] - 60)
    drawn_at(moved)
    touch("touchStart", (-40, 0), (40, 0))
    for apart in (45, 50, 55, 60):
        touch("touchMove", (-apart, 0), (apart, 0))
    touch("touchEnd")
    drawn_at((moved[0] * 1.5, moved[1] * 1.5))


def test_inputs_of_the_board_have_names(phone: Page) -> None:
    phone.click("#tab-inout")
    for name in ("Schutztür", "Halt-Taste", "Start-Taste"):
        expect(phone.get_by_label(name)).to_be_visible()


def test_the_table_of_motor_drivers_needs_no_scrolling(built_page: Path, watched: Callable[..., Watched]) -> None:
    """In the longest words; the button at its end is whole."""
    with settings_tab(built_page, watched, "fysetc-e4", look="phone") as (page, _):
        expect(page.locator("[data-test=driver-X]")).to_be_visible()
        page.locator("[data-test=language]").select_option("de")
        expect(page.locator("[data-test=driver-X]")).to_contain_text("nicht geschrieben")
        wide = page.locator("[data-test=drivers]").evaluate(
            "table => table.parentElement.scrollWidth - table.parentElement.clientWidth"
        )
        assert wide <= 0


# ---- units ----


def test_inches_are_said(socket_link: Callable[..., Console]) -> None:
    """$13=1: positions and feed come in inches, and the page calls them so."""
    console = socket_link(settings=INCHES, speed=SLOW)
    expect(console.page.get_by_role("heading", name="Position, inch")).to_be_visible()
    typed(console, "G20G91G1X1F20")
    console.tab("control")
    expect(console.by("feed-now")).to_have_text("20.0 inch/min")


def test_millimetres_are_said(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=SLOW)
    expect(console.page.get_by_role("heading", name="Position, mm")).to_be_visible()
    typed(console, "G21G91G1X10F600")
    console.tab("control")
    expect(console.by("feed-now")).to_have_text("600 mm/min")


# ---- the picture of a job that runs ----

COUNT = """() => {
    window.drawn = 0;
    const { lineTo } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.lineTo = function (...place) { window.drawn++; lineTo.apply(this, place); };
}"""


def test_a_report_does_not_draw_the_whole_path_again(socket_link: Callable[..., Console]) -> None:
    """While a long job runs, what is drawn for all its reports is less than the path once."""
    console = socket_link(speed=0.2)
    rounds = 4000
    load(console, square(rounds))
    expect(console.by("job-time")).to_be_visible()
    console.by("job-start").click()
    console.is_in("Run")
    console.page.evaluate(COUNT)
    before = console.by("job-line").inner_text() if console.by("job-line").count() else ""
    for _ in range(10):  # reports that show another place
        place = console.page.locator(".path canvas").get_attribute("aria-label")
        console.page.wait_for_function("place => document.querySelector('.path canvas').ariaLabel !== place", arg=place)
    assert console.page.evaluate("window.drawn") < 4 * rounds, before
    console.by("hold").click()
    console.is_in("Hold")


# Top of each button of the tab, from the top of the page.
TOPS = """() => {
    const buttons = document.querySelectorAll("main .start-stop button, main .override button, [data-test=run-again]");
    const top = (button) => Math.round(button.getBoundingClientRect().top + scrollY);
    const name = (button) => button.getAttribute("aria-label") ?? button.textContent;
    return Object.fromEntries([...buttons].map((each) => [name(each), top(each)]));
}"""


@pytest.mark.parametrize("look", ["light", "phone"])
def test_what_a_job_says_and_how_it_ends_move_no_control(socket_link: Callable[..., Console], look: str) -> None:
    console = socket_link()
    console.page.set_viewport_size(LOOKS[look]["viewport"])  # type: ignore[arg-type]
    load(console, "G1X1F600\nM0 (Check the clamps, all four of them, and the hose)\nG1X2\n")
    expect(console.page.get_by_text("Check passed")).to_be_visible()
    before = console.page.evaluate(TOPS)
    assert len(before) > 12
    console.by("job-start").click()
    console.is_in("Hold")
    expect(console.page.get_by_text("The program waits for Resume")).to_be_visible()
    expect(console.page.locator(".notices").get_by_text("Check the clamps")).to_be_visible()
    assert console.page.evaluate(TOPS) == before
    console.by("resume").click()
    console.is_in("Idle")
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    assert console.page.evaluate(TOPS) == before
