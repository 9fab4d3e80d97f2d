"""Machine profiles and `$110=...` text on the page: shown first, then written, and every refusal is reported."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from console_page import Console, load, square
from playwright.sync_api import expect
from wificnc.profile.load import PROFILES, load_machine

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"


def bring(console: Console, test_id: str, name: str, text: str) -> None:
    console.by(test_id).set_input_files({"name": name, "mimeType": "text/plain", "buffer": text.encode()})


def test_a_machine_profile_is_shown_and_written(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("settings")
    bring(console, "settings-file", "shapeoko3.toml", (PROFILES / "shapeoko3.toml").read_text())
    expect(console.page.get_by_text("shapeoko3.toml: ")).to_be_visible()
    travel = console.page.get_by_label("$131 max_travel_mm Y")
    expect(travel).to_have_value("465.000")
    console.by("settings-apply").click()
    expect(console.by("settings-review")).to_contain_text("$131 max_travel_mm Y300.000465.000")
    console.page.screenshot(path="build/tests/import-review.png")
    console.by("settings-send").click()
    expect(console.page.get_by_text("not applied yet")).to_have_count(0)
    console.page.reload()
    console.is_in("Idle")
    for number, text in load_machine("shapeoko3").settings_texts().items():
        field = console.page.locator(f"[data-test=setting-{number}] input")
        if field.get_attribute("type") == "checkbox":
            assert field.is_checked() == (text != "0"), number
        else:
            assert float(field.input_value()) == float(text), number


def test_every_refusal_of_dollar_text_is_reported(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("settings")
    bring(console, "settings-file", "old.txt", "$20=1\n$21=1 (hard limits)\n$110=4000.000\n$111=6000\n$9999=3\n")
    expect(console.page.get_by_text("old.txt: 3 settings differ")).to_be_visible()
    expect(console.page.get_by_text("does not have $9999")).to_be_visible()
    console.by("settings-apply").click()
    console.by("settings-send").click()
    refused = console.by("settings-refused").locator("li")
    expect(refused).to_have_count(1)
    expect(refused).to_contain_text("$20 soft_limits: error 10")
    expect(console.page.get_by_text("1 of 3 settings were refused")).to_be_visible()
    console.page.screenshot(path="build/tests/import-refused.png")
    console.by("settings-close").click()
    expect(console.page.get_by_text("One setting is changed and not applied yet")).to_be_visible()
    expect(console.page.get_by_label("$110 max_rate_mm_min X")).to_have_value("4000.000")


def test_a_broken_profile_changes_nothing(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("settings")
    text = (PROFILES / "shapeoko3.toml").read_text()
    bring(console, "settings-file", "bad.toml", text.replace("travel_mm = 425", "travel = 425"))
    expect(console.page.get_by_role("alert").filter(has_text="unknown key axis.x.travel")).to_be_visible()
    expect(console.by("settings-apply")).to_have_count(0)


def test_a_machine_is_chosen_in_the_guide(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("guide")
    choice = console.by("machine-profile")
    choice.focus()
    choice.select_option(label="MPCNC")
    expect(console.by("settings-review")).to_be_visible()
    console.page.evaluate(AXE.read_text())
    found = console.page.evaluate("async () => (await axe.run()).violations.map((v) => v.id + ': ' + v.nodes[0].html)")
    assert found == []
    console.page.keyboard.press("Escape")
    expect(console.by("settings-review")).to_have_count(0)
    expect(console.by("guide-written").locator("li")).to_have_count(0)
    choice.focus()
    choice.select_option(label="MPCNC")
    console.by("settings-send").click()
    written = console.by("guide-written").locator("li")
    expect(written.first).to_be_visible()
    expect(console.page.get_by_role("heading", name="2. Switches")).to_be_visible()


def test_nothing_is_written_while_a_job_runs(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=0.2)
    load(console, square(40))
    console.by("job-start").click()
    console.is_in("Run")
    console.tab("settings")
    bring(console, "settings-file", "new.txt", "$110=4000\n")
    expect(console.by("settings-apply")).to_be_disabled()
    expect(console.by("settings-apply")).to_have_attribute(
        "title", "A job is running: stop it, or wait until it is finished."
    )
    console.tab("guide")
    bring(console, "guide-file", "new.txt", "$110=4000\n")
    expect(console.by("settings-review")).to_be_visible()
    expect(console.by("settings-send")).to_be_disabled()
