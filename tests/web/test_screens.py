"""Every tab in light, in dark and on a phone: no rule of accessibility broken (axe-core), nothing too wide, a picture.

The pictures lie in build/web/screens, to be looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from console_page import SLOW, press
from playwright.sync_api import Page, expect
from slow import deep_but
from web_fixture import DESKTOP, Watched
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

ROOT = Path(__file__).resolve().parents[2]
SCREENS = ROOT / "build" / "web" / "screens"
AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
FIRST_LOAD_BYTES = 80 * 1024  # on the wire
TABS = ("control", "job", "terminal", "settings", "pins", "network", "inout", "install")
LOOKS = {
    "light": {"viewport": DESKTOP, "color_scheme": "light"},
    "dark": {"viewport": DESKTOP, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}, "color_scheme": "light", "has_touch": True},
}
# Every tab is looked at in each look; what comes up on some of them only once, and in the others each night.
ONE_LOOK = deep_but("light".__eq__, LOOKS)


@pytest.fixture
def opened(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> Callable[..., Page]:
    """The page in a look, connected to a controller with these options."""

    def start(look: str, **options: object) -> Page:
        SCREENS.mkdir(parents=True, exist_ok=True)
        _, served = serve_page(**options)
        page = watched(reduced_motion="reduce", bypass_csp=True, **LOOKS[look]).page(served.url)
        expect(page.locator("[data-test=state]")).to_have_text("Idle")
        expect(page.locator(".facts").first).to_contain_text("G54")  # the last question: a job is checked once
        page.add_script_tag(path=AXE)  # no part of the page: hence bypass_csp
        return page

    return start


COLOURS = {"runOnly": ["color-contrast", "link-in-text-block"]}
NO_COLOURS = {"rules": {"color-contrast": {"enabled": False}}}


def rules_of(look: str) -> dict[str, object]:
    """Of axe-core, which takes seconds for a tab. The dark look differs from the light one in colours alone."""
    return COLOURS if look == "dark" else {}


def broken_rules(page: Page, rules: dict[str, object] | None = None, within: str = "html") -> list[str]:
    """What axe-core finds, with the places."""
    run = "([within, rules]) => axe.run(within, { resultTypes: ['violations'], ...rules })"
    found = page.evaluate(run, [within, rules or {}])
    return [f"{rule['id']}: {node['html'][:160]}" for rule in found["violations"] for node in rule["nodes"]]


@pytest.mark.parametrize("look", LOOKS)
def test_every_tab(opened: Callable[..., Page], look: str) -> None:
    page = opened(look)
    page.click("#tab-job")
    page.locator("[data-test=job-file]").set_input_files(ROOT / "examples" / "pcb_outline.nc")
    expect(page.locator("[data-test=job-time]")).to_be_visible()
    broken: list[str] = []
    for tab in TABS:
        page.click(f"#tab-{tab}")
        if tab == "install":
            page.click("[data-test=board-esp32s3-devkitc]")
        page.screenshot(path=SCREENS / f"{tab}-{look}.png")
        broken += [f"{tab}: {text}" for text in broken_rules(page, rules_of(look))]
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0, f"{tab} is {wide} px wider than the screen"
    assert not broken, "\n".join(broken)


CAM = "%\nO1000 (BRACKET)\nT1 M6\nG21G90G0Z1\nG1X20Y10F300\nY0\nT2 M6\nG0X0\nM30\n%\n"


@pytest.mark.parametrize("look", ONE_LOOK)
def test_what_a_job_forbids(opened: Callable[..., Page], look: str) -> None:
    """The question before a lift; a job that waits for its tool, and what cannot be pressed meanwhile."""
    page = opened(look, speed=SLOW)
    page.click("[data-test=go-to-zero]")
    expect(page.locator("[data-test=lift]")).to_be_visible()
    page.screenshot(path=SCREENS / f"lift-{look}.png")
    broken = broken_rules(page)
    page.get_by_role("button", name="Cancel").click()
    page.click("#tab-job")
    file = {"name": "bracket.nc", "mimeType": "text/plain", "buffer": CAM.encode()}
    page.locator("[data-test=job-file]").set_input_files(file)
    expect(page.locator("[data-test=tool-changes] li")).to_have_text(["Line 3: T1", "Line 7: T2"])
    page.click("[data-test=job-start]")
    expect(page.locator("[data-test=state]")).to_have_text("Hold")
    expect(page.get_by_text("Change to tool T1, then press Resume")).to_be_visible()
    for tab in ("job", "control", "terminal", "inout", "settings"):
        page.click(f"#tab-{tab}")
        page.screenshot(path=SCREENS / f"busy-{tab}-{look}.png", full_page=True)
        broken += [f"{tab}: {text}" for text in broken_rules(page)]
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0, f"{tab} is {wide} px wider than the screen"
    assert not broken, "\n".join(broken)
    page.click("[data-test=resume]")
    expect(page.locator("[data-test=state]")).to_have_text("Run")
    expect(page.get_by_text("Change to tool T1")).to_have_count(0)


CYCLES = ("plate", "corner", "hole", "boss", "edge", "rotation", "length")
DIALOGS = (
    *((f"probe-{cycle}", "control", f"[data-test=probe-{cycle}]") for cycle in CYCLES),
    ("lift", "control", "[data-test=go-to-zero]"),
    ("macro", "control", "text=New macro"),
    ("warm-up", "control", "text=Warm up spindle"),
    ("tools", "control", "[data-test=tools-open]"),
    ("outline", "job", "[data-test=frame]"),
    ("restore", "settings", "text=Restore defaults"),
)


@pytest.mark.parametrize("look", deep_but("phone".__eq__, LOOKS))  # which has the least room
def test_every_dialog_fits_the_screen(opened: Callable[..., Page], look: str) -> None:
    """Whole, or with a bar to scroll it: no button of it can be out of reach."""
    page = opened(look)
    page.click("#tab-job")
    page.locator("[data-test=job-file]").set_input_files(ROOT / "examples" / "pcb_outline.nc")
    expect(page.locator("[data-test=job-time]")).to_be_visible()
    broken: list[str] = []
    for name, tab, button in DIALOGS:
        page.click(f"#tab-{tab}")
        press(page.locator(button).first)
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible()
        page.screenshot(path=SCREENS / f"dialog-{name}-{look}.png")
        broken += [f"{name}: {text}" for text in broken_rules(page, rules_of(look), "dialog[open]")]
        box, size = dialog.bounding_box(), page.viewport_size
        assert box and size
        inside = box["x"] >= 0 and box["x"] + box["width"] <= size["width"] and box["y"] >= 0
        broken += [] if inside and box["y"] + box["height"] <= size["height"] else [f"{name}: {box} in {size}"]
        wide = dialog.evaluate("dialog => dialog.scrollWidth - dialog.clientWidth")
        broken += [f"{name}: {wide} px wider than its dialog"] if wide > 0 else []
        page.keyboard.press("Escape")
        expect(dialog).to_have_count(0)
    assert not broken, "\n".join(broken)


@pytest.mark.parametrize("look", ONE_LOOK)
def test_the_shapers_of_measured_waves(opened: Callable[..., Page], look: str) -> None:
    page = opened(look)
    page.click("#tab-settings")
    page.click("[data-test=vibration-open]")
    for name, value in (("feed_mm_min", "2400"), ("waves", "8"), ("distance_mm", "7.75")):
        page.locator(f"[data-test=vibration-{name}]").fill(value)
    expect(page.get_by_role("img", name="Vibration that each shaper leaves")).to_be_visible()
    page.screenshot(path=SCREENS / f"vibration-{look}.png")
    assert not broken_rules(page)
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    assert wide <= 0


SQUARE = "{} S700 F3000\nG0 X2 Y2\nG1 X32\nY32\nX2\nY2\nM5\n"
# Pixels of the canvas that are almost black on white, or white on black: what gets the typical energy is not.
STRONG = """canvas => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    let strong = 0;
    for (let i = 0; i < data.length; i += 4) {
        const [r, g, b, a] = data.slice(i, i + 4);
        if (a === 255 && Math.max(r, g, b) - Math.min(r, g, b) < 8 && (dark ? r : 255 - r) > 200) strong++;
    }
    return strong;
}"""


@pytest.mark.parametrize("look", ONE_LOOK)
def test_what_a_laser_burns(opened: Callable[..., Page], look: str) -> None:
    """The corners of a square: with constant power they are the darkest of the path, and the preflight says so."""
    page = opened(look, settings=("$32=1", "$30=1000", "$120=500", "$121=500"))
    page.click("#tab-job")
    strong = {}
    for mode in ("M3", "M4"):
        file = {"name": f"{mode}.nc", "mimeType": "text/plain", "buffer": SQUARE.format(mode).encode()}
        page.locator("[data-test=job-file]").set_input_files(file)
        expect(page.get_by_role("img", name=f"Path of {mode}.nc")).to_be_visible()
        warned = mode == "M3"
        expect(page.get_by_text("Constant power (M3) burns more")).to_have_count(int(warned))
        expect(page.get_by_text("Use M4, whose power follows the speed")).to_have_count(int(warned))
        expect(page.locator(".legend .scale")).to_contain_text("ms/mm")
        page.screenshot(path=SCREENS / f"laser-{mode}-{look}.png", full_page=True)
        strong[mode] = page.locator("canvas").evaluate(STRONG)
        assert not broken_rules(page)
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0
    assert strong["M3"] > strong["M4"], strong
    flat = page.locator("canvas").evaluate("canvas => canvas.toDataURL()")
    page.get_by_role("button", name="3-D").click()
    page.wait_for_function("flat => document.querySelector('canvas').toDataURL() !== flat", arg=flat)
    page.screenshot(path=SCREENS / f"laser-3d-{look}.png")


def test_the_path_in_three_dimensions(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    SCREENS.mkdir(parents=True, exist_ok=True)
    _, served = serve_page()
    page = watched(color_scheme="dark").page(served.url)
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    page.click("#tab-job")
    page.locator("[data-test=job-file]").set_input_files(ROOT / "examples" / "inlay.nc")
    page.get_by_role("button", name="3-D").click()
    expect(page.get_by_role("img", name="Path of inlay.nc")).to_be_visible()
    page.screenshot(path=SCREENS / "path-dark.png")


def test_the_first_load_is_small(
    serve_page: Callable[..., tuple[Server, PageServer]],
    watched: Callable[..., Watched],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What runs a machine: no boards, no loader, no core, no pictures. The time that is printed is this computer's."""
    _, served = serve_page()
    page = watched().page(served.url)
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    for tab in ("job", "terminal", "settings", "control"):
        page.click(f"#tab-{tab}")
    loaded = page.evaluate(
        """() => {
            const [page] = performance.getEntriesByType("navigation");
            const files = performance.getEntriesByType("resource").filter((file) => file.initiatorType !== "fetch");
            const bytes = files.reduce((sum, file) => sum + file.transferSize, page.transferSize);
            return { bytes, count: files.length + 1, ms: page.loadEventEnd };
        }"""
    )
    with capsys.disabled():
        print(f"\nthe page: {loaded['count']} files, {loaded['bytes']:,} bytes, loaded in {loaded['ms']:.0f} ms")
    assert loaded["bytes"] < FIRST_LOAD_BYTES
