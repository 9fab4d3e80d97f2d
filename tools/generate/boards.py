"""Everything in the repository that is written from the board files and their chips' pin tables."""

from __future__ import annotations

from pathlib import Path

from wificnc.board.load import find_boards, load_board
from wificnc.board.picture import draw, svg_text

from generate.board_docs import docs_text, readme_text
from generate.board_lists import list_texts
from generate.board_schema import board_schema_text
from generate.board_start import start_texts


def texts(root: Path) -> dict[str, str]:
    """Path in the repository -> text. Raises ValueError for a hand-written file without its region."""
    boards = [load_board(path) for path in find_boards()]
    return {
        "docs/boards.md": docs_text(boards),
        "boards/README.md": readme_text(boards),
        "boards/board.schema.json": board_schema_text(),
        **{f"boards/pinout/{board.id}.svg": svg_text(draw(board)) for board in boards},
        **{f"docs/start/{name}": text for name, text in start_texts(boards).items()},
        **list_texts(boards, root),
    }
