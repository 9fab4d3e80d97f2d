"""A slow network and a quick hand: a press that comes before the report about the last one acts on what is, and not on
what the page shows."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from console_page import SWITCHES, Console, home, typed
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

# Every message later by window.latency_ms, in order; set when the page is there.
LATENCY = """(() => {
    const Quick = window.WebSocket;
    window.WebSocket = class extends Quick {
        send(data) { setTimeout(() => super.send(data), window.latency_ms ?? 0); }
        set onmessage(take) { super.onmessage = (event) => setTimeout(() => take(event), window.latency_ms ?? 0); }
    };
})()"""
LATENCY_MS = 250
# A jog, which the pad begins when a key goes down, and a press of a button: before any answer can have come.
JOG_AND_PRESS = """([jog, button]) => {
    const down = new KeyboardEvent("keydown", { key: "Enter", bubbles: true });
    document.querySelector(`[data-test='jog-${jog}']`).dispatchEvent(down);
    document.querySelector(button).click();
}"""


def far_away(console: Console) -> None:
    """From now on the network is slow."""
    console.page.add_init_script(LATENCY)
    console.page.reload()
    expect(console.by("home")).to_be_enabled()
    console.page.evaluate(f"window.latency_ms = {LATENCY_MS}")


def test_the_way_to_zero_begins_with_z_up_behind_a_jog(socket_link: Callable[..., Console]) -> None:
    """The report still has Z at its top, where the way would begin with X and Y."""
    console = socket_link(settings=SWITCHES, speed=4.0)
    far_away(console)
    home(console)
    console.stands_at(X=-2, Y=-2, Z=-2)
    typed(console, "G10L2P1X-50Y-50")
    console.tab("control")
    console.stands_at(X=48, Y=48, Z=-2)
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.is_in("Idle")
    console.page.evaluate(JOG_AND_PRESS, ["Z−", "[data-test=go-to-zero]"])
    console.stands_at(X=0, Y=0)
    console.is_in("Idle")
    console.stands_at(Z=-2)


def test_half_of_an_axis_is_half_of_where_it_is(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    far_away(console)
    console.page.get_by_role("button", name="10", exact=True).first.click()
    console.page.evaluate(JOG_AND_PRESS, ["X+", "[aria-label='Halve X']"])
    console.stands_at(X=5)


def test_two_presses_of_undo_are_two_steps_back(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    far_away(console)
    console.page.get_by_role("button", name="1", exact=True).first.click()
    for _ in range(2):
        console.is_in("Idle")
        console.by("jog-X+").click()
        console.stands_at(X=1)
        console.page.get_by_role("button", name="Zero X").click()
        console.stands_at(X=0)
    console.by("undo-zero").dblclick()
    console.stands_at(X=2)
