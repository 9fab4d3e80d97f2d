"""What only the site has: a page of each board with its picture, and the tables of docs/boards.md and docs/states.md.

A hand-written page says in place of a table where else its content is, between `site: NAME` and `site: end`.
"""

from __future__ import annotations

import re
from pathlib import Path

from generate.board_docs import ability_table, board_page, overview_table
from generate.board_start import start_table
from generate.install import PAGE as START
from generate.states import OUTPUT as STATES
from generate.states import cells_html
from generate.states_table import load_states
from wificnc.board.load import find_boards, load_board
from wificnc.board.picture import draw, svg_text

BOARDS = "docs/boards.md"
WIDE = "---\nhide: [toc]\n---\n\n"  # of a page with a table of many columns
FILTER = "docs/filter.js"
REGION = re.compile(r"^<!-- site: (?!end)(\w+) -->\n.*?^<!-- site: end -->\n", re.DOTALL | re.MULTILINE)


def site_texts(root: Path) -> dict[str, str]:
    """Path on the site -> text. @param root  of the hand-written pages

    Raises KeyError for a region that no table is made for."""
    boards = [load_board(path) for path in find_boards()]
    tables = {
        BOARDS: {"boards": overview_table(boards), "abilities": ability_table(boards)},
        START: {"boards": start_table(boards)},
        STATES: {"cells": cells_html(load_states())},
    }
    pages = {
        name: WIDE * (name != START) + with_tables((root / name).read_text(encoding="utf-8"), tables[name])
        for name in tables
    }
    for board in boards:
        pages[f"docs/boards/{board.id}.md"] = board_page(board)
        pages[f"docs/boards/{board.id}.svg"] = svg_text(draw(board))
    return {**pages, FILTER: Path(__file__).with_name("filter.js").read_text(encoding="utf-8")}


def with_tables(page: str, tables: dict[str, str]) -> str:
    """Its regions replaced. Raises KeyError."""
    return REGION.sub(lambda match: tables[match[1]] + "\n", page)
