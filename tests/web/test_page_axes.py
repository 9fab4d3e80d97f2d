"""A machine of three axes on a board of six: the page shows what the machine has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from playwright.sync_api import expect
from web_fixture import MACHINE, Watched
from wificnc.board.load import load_board
from wificnc.serve.options import Address, ServeOptions
from wificnc.serve.page import About, PageServer
from wificnc.serve.server import Server


def test_axes_that_the_machine_has_not_are_not_shown(
    built_page: Path, watched: Callable[..., Watched], tmp_path: Path
) -> None:
    board = load_board("esp32-wroom32")
    options = ServeOptions(board=board, tcp=Address("127.0.0.1", 0), store=tmp_path / "kept", settings=MACHINE)
    with Server(replace(options, settings=("$79=3",))):
        pass  # it counts from the next start on
    with Server(options) as server:
        about = About("WiFiCNC in a test", "0", board.id, len(board.axes))
        with PageServer(Address("127.0.0.1", 0), server.tcp, about, built_page) as served, watched() as context:
            page = context.page(served.url)
            expect(page.get_by_test_id("work-Z").or_(page.locator("[data-test=work-Z]"))).to_have_text("0.000")
            for axis in "XYZ":
                expect(page.get_by_role("button", name=f"Zero {axis}", exact=True)).to_have_count(1)
                expect(page.locator(f"[data-test='jog-{axis}+']")).to_have_count(1)
            for axis in "ABC":
                expect(page.get_by_role("button", name=f"Zero {axis}", exact=True)).to_have_count(0)
                expect(page.locator(f"[data-test='jog-{axis}+']")).to_have_count(0)
            page.get_by_role("tab", name="Settings").click()
            expect(page.get_by_text("steps_per_mm").first).to_be_visible()
            expect(page.locator("input[aria-label^='$103']")).to_have_count(0)
            expect(page.locator("input[aria-label^='$102']")).to_have_count(1)
