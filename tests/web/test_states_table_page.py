"""The filter of the site's table of states (tools/pages/filter.js), in a browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from generate.states import cells_html
from generate.states_table import load_states
from pages import site
from playwright.sync_api import Browser, expect

pytestmark = pytest.mark.slow  # opens a browser


def test_rows_are_found_by_state_and_words(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(f"<!doctype html>{cells_html(load_states())}", encoding="utf-8")
    (tmp_path / "filter.js").write_text(Path(site.__file__).with_name("filter.js").read_text())
    page = browser.new_page()
    page.goto((tmp_path / "page.html").as_uri())
    rows = page.locator("#states tbody tr:visible")
    count = page.locator("#states tbody tr").count()
    expect(page.locator("output")).to_have_text(f"{count} of {count} rows")
    page.get_by_label("State").select_option("jog")
    page.get_by_label("Words").fill("$H  ERROR")
    texts = rows.all_inner_texts()
    assert texts and all(text.startswith("jog") and "$H" in text and "error" in text for text in texts)
    expect(page.locator("output")).to_have_text(f"{len(texts)} of {count} rows")
    page.goto(page.url)  # the address keeps what was asked for
    assert rows.all_inner_texts() == texts
    page.get_by_label("Words").fill("no such words")
    expect(rows).to_have_count(0)
    page.close()
