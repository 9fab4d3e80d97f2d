"""The page that a controller serves itself, in Chromium: it loads, asks for the access key, shows the status, jogs and
runs a job to its end. The PC with its page, and the real image of an ESP32 with its own server, where someone has one
(tests/senders/esp_process.py)."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from console_page import square
from esp_process import IMAGE, EspProcess
from patience import HANG_S
from playwright.sync_api import Page, expect
from web_fixture import MACHINE, Watched

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

KEY, STEPS_PER_MM = "open sesame", 80
ON_CHIP = tuple(word for line in MACHINE for word in ("--set", line))


class Served(NamedTuple):
    """A controller with its page."""

    url: str
    key: str
    control: str  # of a chip: its control port


@pytest.fixture(params=["host", *["esp"] * bool(IMAGE)])
def served(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Served]:
    if request.param == "esp":
        with EspProcess(tmp_path, *ON_CHIP) as process:
            yield Served(process.doors["page"], process.options.key, process.doors["control"])
        return
    _, page = request.getfixturevalue("serve_page")(key=KEY)
    yield Served(page.url, KEY, "")


def stands(served: Served, page: Page, **axes: float) -> None:
    """The page shows it, and on a chip the pulses have gone there."""
    for axis, mm in axes.items():
        expect(page.locator(f"[data-test=work-{axis}]")).to_have_text(f"{mm:.3f}")
    if served.control:
        host, _, port = served.control.rpartition(":")
        with socket.create_connection((host, int(port)), HANG_S) as door, door.makefile() as answers:
            door.sendall(b"position\n")
            assert list(map(int, re.findall(r"-?\d+", answers.readline())))[: len(axes)] == [
                round(STEPS_PER_MM * mm) for mm in axes.values()
            ]


def test_it_loads_shows_jogs_and_cuts(served: Served, watched: Callable[..., Watched]) -> None:
    page = watched().page(served.url)
    page.get_by_label("Access key").fill(served.key)
    page.get_by_role("button", name="Log in").click()
    expect(page.locator("[data-test=resume]")).to_be_enabled()
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    page.get_by_role("button", name="10", exact=True).first.click()
    page.locator("[data-test='jog-X+']").click()
    expect(page.locator("[data-test=work-X]")).to_have_text("10.000")
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    stands(served, page, X=10, Y=0, Z=0)
    page.click("#tab-job")
    job = {"name": "square.nc", "mimeType": "text/plain", "buffer": square(2).encode()}
    page.locator("[data-test=job-file]").set_input_files(job)
    expect(page.locator("[data-test=job-time]")).to_be_visible()
    page.locator("[data-test=job-start]").click()
    expect(page.get_by_text("The job is finished")).to_be_visible()
    expect(page.locator("[data-test=state]")).to_have_text("Idle")
    page.click("#tab-control")
    stands(served, page, X=0, Y=0, Z=-1)
