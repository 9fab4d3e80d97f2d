"""The documentation's site: links lead somewhere, no other server is asked, and what it quotes is in the code."""

from __future__ import annotations

import re
import shutil
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import click
import pytest
from generate.board_docs import board_page
from lint.english import check_text
from pages.build import build
from pages.site import site_texts, with_tables
from pages.stage import collect
from wificnc.app import COMMANDS, root
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root
from wificnc.connection.words import ALARMS, ERRORS
from wificnc.tables.settings import load_settings

ROOT = checkout_root()
BOARDS = [path.stem for path in find_boards()]
ADVICE = sorted((ROOT / "docs").glob("**/*.md"))
TROUBLE = (ROOT / "docs" / "troubleshooting.md").read_text()
LOADING = {"script": "src", "img": "src", "iframe": "src", "link": "href", "source": "src", "object": "data"}


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site's own part of the repository."""
    root = tmp_path_factory.mktemp("site") / "repository"
    for file in [*collect(ROOT), Path("mkdocs.yml")]:
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / file, root / file)
    return root


@pytest.fixture(scope="module")
def site(tree: Path) -> Path:
    assert build(tree, tree / "out") == []
    return tree / "out"


class Loads(HTMLParser):
    """What a page makes a browser fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag in LOADING and values.get("rel") not in ("canonical", "next", "prev"):
            self.found.append(values.get(LOADING[tag]) or "")


def test_no_page_asks_another_server(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        loads = Loads()
        loads.feed(page.read_text())
        assert loads.found and not [url for url in loads.found if re.match(r"(https?:)?//", url)], page.name
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", sheet.read_text()), sheet.name


def test_each_board_has_its_page_and_picture(site: Path) -> None:
    overview, start = [(site / f"docs/{page}.html").read_text() for page in ("boards", "start/index")]
    for board in BOARDS:
        assert '<img alt="Pin-out of' in (site / f"docs/boards/{board}.html").read_text(), board
        assert (site / f"docs/boards/{board}.svg").is_file()
        assert f'href="boards/{board}.html"' in overview
        assert board.startswith("host") or f'href="../boards/{board}.html"' in start


def test_a_region_without_a_table_is_found() -> None:
    page = "a\n<!-- site: cells -->\nelsewhere\n<!-- site: end -->\nb\n"
    assert with_tables(page, {"cells": "| x |"}) == "a\n| x |\nb\n"
    with pytest.raises(KeyError, match="cells"):
        with_tables(page, {"boards": ""})


def test_no_region_is_left_on_the_site(tree: Path) -> None:
    for name, text in site_texts(tree).items():
        assert "<!-- site:" not in text, name


def test_the_pages_of_boards_are_plain_english() -> None:
    """The lint reads what git keeps."""
    assert [found for path in find_boards() for found in check_text(path, board_page(load_board(path)))] == []


@pytest.mark.slow
def test_what_leads_nowhere_is_found(tree: Path) -> None:
    """A page, an anchor, a file, a picture; and a page that the menu does not have."""
    page, orphan = tree / "docs" / "simulation.md", tree / "docs" / "orphan.md"
    good = page.read_text()
    links = "[a](nowhere.md) [b](sending.md#nonsense) [c](../core/nowhere.c) ![d](images/nowhere.png)"
    page.write_text(f"{good}\n{links}\n")
    orphan.write_text("# Orphan\n")
    try:
        problems = build(tree, tree / "broken")
    finally:
        page.write_text(good)
        orphan.unlink()
    for wanted in ("nowhere.md", "nonsense", "nowhere.c", "nowhere.png", "orphan.md"):
        assert any(wanted in problem for problem in problems), wanted


def test_the_site_has_the_help_of_each_command(site: Path) -> None:
    """Names, options and texts, as click itself has them."""
    page = unescape(re.sub(r"<[^>]+>", "", (site / "docs" / "commands.html").read_text()))
    assert "Sentinel" not in page and "\b" not in page

    def look(command: click.Command, path: str, parent: click.Context) -> int:
        ctx = click.Context(command, info_name=path.split()[-1], parent=parent)
        assert f"\n{path} [" in page, path
        for param in command.params:
            for name in (*param.opts, *param.secondary_opts) if isinstance(param, click.Option) else ():
                assert name in page, f"{path} {name}"
        children = command.list_commands(ctx) if isinstance(command, click.Group) else []
        found = [(name, child) for name in children if (child := command.get_command(ctx, name)) and not child.hidden]  # type: ignore[attr-defined]
        return 1 + sum(look(child, f"{path} {name}", ctx) for name, child in found)

    with click.Context(root, info_name="wificnc") as ctx:
        assert sum(look(root.get_command(ctx, name), f"wificnc {name}", ctx) for name in COMMANDS) > 50  # type: ignore[arg-type]


def test_messages_quoted_are_said_by_the_firmware() -> None:
    """An ellipsis stands for what changes."""
    sources = [path for folder in ("core", "targets") for path in (ROOT / folder).rglob("*.c")]
    said = "\n".join(path.read_text() for path in sources)
    quoted = re.findall(r"\[MSG:([^\]]+)\]", TROUBLE)
    assert len(quoted) > 10
    for message in quoted:
        for piece in re.split(r"…|\bN\b|\$110|\$TAKE", message):
            assert not piece.strip() or piece.strip() in said, message


def test_numbers_and_commands_quoted_exist() -> None:
    numbers = {
        setting.number + axis for setting in load_settings().setting for axis in range(6 if setting.per_axis else 1)
    }
    for page in ADVICE:
        text = page.read_text()
        assert {int(n) for n in re.findall(r"\bALARM:(\d+)", text)} <= set(ALARMS), page
        assert {int(n) for n in re.findall(r"\berror:(\d+)", text)} <= set(ERRORS), page
        assert set(re.findall(r"`wificnc ([a-z0-9]+)", text)) <= set(COMMANDS), page
    assert {int(n) for n in re.findall(r"\$(\d+)", TROUBLE)} <= numbers


def test_every_alarm_has_its_advice() -> None:
    headings = " ".join(line for line in TROUBLE.splitlines() if line.startswith("### "))
    told = {int(number) for number in re.findall(r"ALARM:(\d+)", headings)}
    assert told >= set(ALARMS) - {6, 7}  # homing ended by a reset or the door says all there is to say
