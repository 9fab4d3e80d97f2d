"""`python -m wificnc.board.generate [--check]`: everything in the repository that is written from the board files."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from wificnc.board import paths
from wificnc.board.docs import docs_text, readme_text
from wificnc.board.header import write_if_changed
from wificnc.board.load import find_boards, load_board
from wificnc.board.picture import draw, svg_text
from wificnc.board.schema import board_schema_text
from wificnc.board.start import start_texts
from wificnc.checked.paths import shown


def generated_files() -> dict[Path, str]:
    """Path to text of every generated file."""
    boards = [load_board(path) for path in find_boards()]
    pictures = {paths.BOARDS / "pinout" / f"{board.id}.svg": svg_text(draw(board)) for board in boards}
    return {
        paths.DOCS / "boards.md": docs_text(boards),
        paths.BOARDS / "README.md": readme_text(boards),
        paths.BOARDS / "board.schema.json": board_schema_text(),
        **pictures,
        **{paths.DOCS / "start" / name: text for name, text in start_texts(boards).items()},
    }


def stale_files() -> list[Path]:
    """Generated files that differ from what the board files say now."""
    return [
        path
        for path, text in generated_files().items()
        if not path.is_file() or path.read_text(encoding="utf-8") != text
    ]


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m wificnc.board.generate", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if something is stale")
    if parser.parse_args(argv).check:
        stale = stale_files()
        for path in stale:
            print(f"stale: {shown(path)}", file=sys.stderr)
        return 1 if stale else 0
    for path, text in generated_files().items():
        if write_if_changed(path, text):
            print(f"wrote {shown(path)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
