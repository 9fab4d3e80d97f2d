"""The pictures of docs/wiring are those that tools/wiring draws, and each is in a page."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from wificnc.build.checkout import checkout_root
from wiring.pictures import IMAGES, PICTURES

PAGES = checkout_root() / "docs" / "wiring"
USED = re.compile(r"!\[([^\]]+)\]\(images/([a-z-]+)\.svg\)")


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_drawn_from_its_source(name: str) -> None:
    drawn = PICTURES[name]().svg()
    assert (IMAGES / f"{name}.svg").read_text(encoding="utf-8") == drawn, "make pictures"
    assert ElementTree.fromstring(drawn).tag.endswith("svg")


def test_each_picture_is_in_a_page_with_words_for_who_cannot_see_it() -> None:
    found = [use for page in PAGES.glob("*.md") for use in USED.findall(page.read_text(encoding="utf-8"))]
    assert sorted(name for _, name in found) == sorted(PICTURES)
    assert all(len(words) > 10 for words, _ in found)
    assert {path.stem for path in IMAGES.iterdir()} == set(PICTURES)
