"""The set-up guide against a served controller: what it writes is what the controller has, and it can be left."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from console_page import Console
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"


def answer_questions(console: Console) -> None:
    written = console.by("guide-written")
    console.by("guide-travel-X").fill("420")
    console.by("guide-rate-X").fill("5000")
    console.by("guide-turn-Z").fill("8")
    console.by("guide-turn-X").fill("4o")
    console.by("guide-apply").click()
    expect(console.page.get_by_text("4o: a number above 0 is needed")).to_be_visible()
    expect(written.locator("li")).to_have_count(0)  # all or nothing
    console.by("guide-turn-X").fill("")
    console.by("guide-apply").click()
    # 200 full steps, 16 microsteps and a lead of 8 mm are 400 steps/mm
    expect(written.locator("li")).to_have_text(
        [
            "$102 steps_per_mm Z: 80 → 400",
            "$110 max_rate_mm_min X: 6000 → 5000",
            "$130 max_travel_mm X: 300 → 420",
        ]
    )


def try_switch(console: Console) -> None:
    expect(console.page.get_by_role("heading", name="2. Switches")).to_be_visible()
    switch = console.by("guide-switch-X")
    expect(switch).to_contain_text("press and release it")
    assert console.hands("travel x 0.5 1000") == "ok"
    expect(switch).to_contain_text("pressed")
    assert console.hands("travel x -1 1000") == "ok"
    expect(switch).to_contain_text("open✓ works")
    expect(console.by("guide-switch-Y")).to_contain_text("press and release it")
    console.by("guide-next").click()


def turn_direction(console: Console) -> None:
    written = console.by("guide-written")
    console.by("guide-jog-X+").click()
    expect(console.page.locator("[data-test=guide-at-X]")).to_have_text("5.000")
    console.is_in("Idle")
    console.by("guide-flip-X").click()
    expect(written.locator("li").last).to_have_text("$3 dir_invert_mask : 0 → 1")


def test_a_machine_is_set_up_step_by_step(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("guide")
    written = console.by("guide-written")
    answer_questions(console)
    try_switch(console)
    turn_direction(console)

    console.page.reload()  # left, and continued
    console.is_in("Idle")
    console.tab("guide")
    expect(console.page.get_by_role("heading", name="3. Directions")).to_be_visible()
    expect(written.locator("li")).to_have_count(4)
    console.by("guide-next").click()

    console.by("guide-measured-Y").fill("25")
    console.by("guide-correct-Y").click()
    expect(written.locator("li").last).to_have_text("$101 steps_per_mm Y: 80 → 160")
    console.by("guide-next").click()

    expect(console.by("guide-home")).to_be_disabled()
    console.by("guide-homing").click()
    expect(written.locator("li").last).to_have_text("$22 homing : 0 → 1")
    expect(console.by("guide-home")).to_be_enabled()
    console.by("guide-homing").click()
    expect(written.locator("li").last).to_have_text("$22 homing : 1 → 0")
    console.by("guide-next").click()

    console.by("guide-jog-Y+").click()
    expect(console.by("guide-at-Y")).to_have_text("5.000")
    console.tab("settings")
    console.page.get_by_placeholder("Find by number, name or word").fill("$101 ")
    expect(console.page.get_by_label("$101 steps_per_mm Y")).to_have_value("160.000")


def test_a_settings_file_sets_the_machine_up(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    console.tab("guide")
    text = b"$100=250\n$131=500\n"
    console.by("guide-file").set_input_files({"name": "mill.txt", "mimeType": "text/plain", "buffer": text})
    expect(console.by("settings-review").locator("tbody tr")).to_have_text(
        [re.compile(r"^\$100 steps_per_mm X80\.000250$"), re.compile(r"^\$131 max_travel_mm Y300\.000500$")]
    )
    expect(console.by("guide-written").locator("li")).to_have_count(0)  # nothing is written before it was shown
    console.by("settings-send").click()
    expect(console.by("guide-written").locator("li")).to_have_text(
        ["$100 steps_per_mm X: 80 → 250", "$131 max_travel_mm Y: 300 → 500"]
    )
    expect(console.page.get_by_role("heading", name="2. Switches")).to_be_visible()


def test_it_fits_a_phone_and_has_no_fault_of_accessibility(socket_link: Callable[..., Console]) -> None:
    console = socket_link()
    page = console.page
    page.set_viewport_size({"width": 390, "height": 844})
    console.tab("guide")
    page.evaluate(AXE.read_text())
    for step in range(6):
        expect(page.get_by_role("heading", name=f"{step + 1}. ")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), step
        faults = page.evaluate("async () => (await axe.run()).violations.map((v) => v.id + ': ' + v.nodes[0].html)")
        assert faults == [], step
        page.screenshot(path=f"build/tests/guide-{step + 1}.png", full_page=True)
        if step < 5:
            console.by("guide-next").click()
