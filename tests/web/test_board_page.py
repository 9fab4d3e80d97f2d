"""The page as an ESP32 serves it: a browser, the firmware's own web server, and its controller task."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from esp32_serve import BOARD, serving_esp32
from playwright.sync_api import Locator, expect
from web_fixture import Watched
from wificnc.board.load import find_boards, load_board
from wificnc.firmware.page_header import embedded_files

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

# What the slot of targets/esp32/partitions.csv (1.875 MB) leaves behind the firmware, which had 0.91 MB alone
# (docs/performance.md), and half a megabyte for what comes; cli/wificnc/build/esp32_size.py warns above 1.4 MB.
FLASH_BYTES = 420 * 1024
LINES = 20


@pytest.mark.parametrize("board", [path.stem for path in find_boards() if load_board(path).target == "esp32"])
def test_the_page_is_small_enough_for_the_firmware(built_page: Path, board: str) -> None:
    """With the picture of its own board, and of no other."""
    files = embedded_files(built_page, board)
    assert not {"/sw.js", "/app.webmanifest"} & {file.path for file in files}, "of https addresses"
    assert sum(file.size for file in files) <= FLASH_BYTES
    (picture,) = [file.path for file in files if file.path.startswith("/assets/") and file.path.endswith(".svg")]
    assert picture.startswith(f"/assets/{board}-")


@pytest.mark.parametrize("password", ["", "correct horse"])
def test_a_browser_needs_nothing_but_the_board(
    built_page: Path, watched: Callable[..., Watched], password: str
) -> None:
    with serving_esp32(password, files=embedded_files(built_page)) as ports, watched() as context:
        page = context.page(f"http://127.0.0.1:{ports.page}/")

        def by(test_id: str) -> Locator:
            return page.locator(f"[data-test='{test_id}']")

        if password:
            page.locator("input[type=password]").first.fill(password)
            page.keyboard.press("Enter")
        expect(by("state")).to_have_text("Idle")
        page.get_by_role("button", name="1", exact=True).first.click()
        by("jog-X−").click()
        expect(by("work-X")).to_have_text("-1.000")
        job = "G21G90\n" + "".join(f"G1X{n % 2}Y{n / 5:g}F3000\n" for n in range(LINES))
        page.click("#tab-job")
        by("job-file").set_input_files({"name": "job.nc", "mimeType": "text/plain", "buffer": job.encode()})
        expect(by("job-time")).to_be_visible()  # the preflight, on the core as WebAssembly
        by("job-start").click()
        page.click("#tab-control")
        expect(by("work-Y")).to_have_text(f"{(LINES - 1) / 5:.3f}")
        expect(by("state")).to_have_text("Idle")
        page.click("#tab-pins")
        expect(page.get_by_label("Board")).to_have_value(BOARD)
        if password:
            page.click("#tab-settings")
            by("trust-day").click()
            expect(by("trusted")).to_contain_text("127.0.0.1")
            page.get_by_label("Revoke 127.0.0.1").click()
            expect(by("trusted")).to_have_count(0)
