"""The page in the languages of its catalogues (web/words): the browser's, or the one that is chosen in the page.

The pictures lie in build/web/screens, to be looked at: German words are long.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from slow import cases_but
from test_screens import AXE, LOOKS, NO_COLOURS, SCREENS, broken_rules
from web_fixture import Watched
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

WORDS = Path(__file__).resolve().parents[2] / "web" / "words"
TABS = ("control", "job", "terminal", "guide", "settings", "pins", "network", "inout", "install")
# Every text that is read: of elements, and of attributes that are shown or spoken.
TEXTS = """() => {
    const texts = [];
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walk.nextNode()) texts.push(walk.currentNode.data.trim());
    for (const name of ["aria-label", "title", "placeholder"])
        for (const element of document.querySelectorAll(`[${name}]`)) texts.push(element.getAttribute(name).trim());
    return texts;
}"""
Serve = Callable[..., tuple[Server, PageServer]]
LANGUAGES, WIDTHS = ("de", "es"), ("phone", "light")  # words change no colour: the dark look is left out
IN_CI = {("phone", "de"), ("light", "es")}


def words(language: str, *files: str) -> dict[str, str]:
    """English -> other language."""
    parts = [json.loads((WORDS / f"{file}.{language}.json").read_text(encoding="utf-8")) for file in files]
    return {text.strip(): other.strip() for part in parts for text, other in part.items()}


def left_in_english(page: Page, known: dict[str, str]) -> set[str]:
    """Texts of the page that have a translation, and are not shown in it."""
    english = {text for text, other in known.items() if other != text} - set(known.values())
    return english & set(page.evaluate(TEXTS))


@pytest.mark.parametrize(("look", "language"), cases_but(lambda *case: case in IN_CI, WIDTHS, LANGUAGES))
def test_every_tab_is_in_the_language_of_the_browser(
    serve_page: Serve, watched: Callable[..., Watched], look: str, language: str
) -> None:
    SCREENS.mkdir(parents=True, exist_ok=True)
    known = words(language, "page", "tables", "boards")
    _, served = serve_page()
    page = watched(reduced_motion="reduce", bypass_csp=True, locale=f"{language}-419", **LOOKS[look]).page(served.url)
    expect(page.locator("[data-test=state]")).to_have_text(known["Idle"])
    assert page.locator("html").get_attribute("lang") == language
    page.add_script_tag(path=AXE)
    wrong: list[str] = []
    for tab in TABS:
        page.click(f"#tab-{tab}")
        expect(page.get_by_text(known["Loading"], exact=True)).to_have_count(0)
        page.screenshot(path=SCREENS / f"{tab}-{look}-{language}.png")
        wrong += [f"{tab}: in English: {text}" for text in left_in_english(page, known)]
        wrong += [f"{tab}: {text}" for text in broken_rules(page, NO_COLOURS)]
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        wrong += [f"{tab}: {wide} px too wide"] if wide > 0 else []
    assert not wrong, "\n".join(wrong)
    page.click("#tab-control")
    expect(page.locator("[data-test='work-X']")).to_have_text("0.000")  # the machine's form, not 0,000


def test_another_language_is_chosen_in_the_page(serve_page: Serve, watched: Callable[..., Watched]) -> None:
    """Nothing is sent to the controller, and the choice is kept for the next time."""
    _, served = serve_page()
    page = watched().page(served.url)
    state, settings = page.locator("[data-test=state]"), page.locator("#tab-settings")
    expect(state).to_have_text("Idle")
    expect(settings).to_have_text("Settings")
    expect(page.locator(".facts").first).to_contain_text("G54")  # the page has asked all that it asks by itself
    log = page.locator("[data-test=terminal] *")
    page.click("#tab-terminal")
    sent = log.count()
    for language, idle, title in (
        ("de", "Bereit", "Einstellungen"),
        ("es", "Lista", "Ajustes"),
        ("en", "Idle", "Settings"),
    ):
        page.locator("[data-test=language]").select_option(language)
        expect(settings).to_have_text(title)
        expect(state).to_have_text(idle)
        assert page.locator("html").get_attribute("lang") == language
        assert log.count() == sent
    page.locator("[data-test=language]").select_option("de")
    expect(settings).to_have_text("Einstellungen")
    page.reload()
    expect(settings).to_have_text("Einstellungen")
    expect(state).to_have_text("Bereit")


def test_what_is_refused_is_explained_in_the_language(serve_page: Serve, watched: Callable[..., Watched]) -> None:
    """Errors and alarms of the controller, with their cause and what helps."""
    _, served = serve_page(settings=("$22=1", "$20=1"))
    page = watched(locale="de-DE").page(served.url)
    known = words("de", "page", "tables")
    expect(page.locator("[data-test=state]")).to_have_text("Alarm")
    expect(page.get_by_text(known["The machine is locked"], exact=True)).to_be_visible()
    expect(
        page.get_by_text(known["Home it on the tab Control, or unlock it if you know its position."])
    ).to_be_visible()
    page.locator("[data-test=unlock]").click()
    expect(page.locator("[data-test=state]")).to_have_text("Bereit")
    page.click("#tab-terminal")
    page.get_by_label(known["Line to send"]).fill("G1X1")
    page.keyboard.press("Enter")
    expect(page.get_by_text("der Vorschub fehlt (F)")).to_be_visible()


@pytest.mark.parametrize("language", ["de", "es"])
def test_first_contact_is_in_the_language_of_the_phone(
    serve_page: Serve, watched: Callable[..., Watched], language: str
) -> None:
    _, served = serve_page()
    known = words(language, "contact")
    page = watched(bypass_csp=True, locale=language, **LOOKS["phone"]).page(f"{served.url}setup.html")
    expect(page.get_by_role("status")).to_have_text(
        known["This controller has no WiFi to set up: it uses the network of its computer."]
    )
    assert page.locator("html").get_attribute("lang") == language
    expect(page).to_have_title(known["WiFi of the controller"])
    assert left_in_english(page, known) == set()
    page.add_script_tag(path=AXE)
    assert not broken_rules(page)
