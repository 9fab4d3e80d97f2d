"""`python -m wificnc.board.generate [--check]`: everything in the repository that is written from the board files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from wificnc import generated
from wificnc.board import paths
from wificnc.board.docs import docs_text, readme_text
from wificnc.board.load import find_boards, load_board
from wificnc.board.picture import draw, svg_text
from wificnc.board.schema import board_schema_text
from wificnc.board.start import start_texts


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


def main(argv: Sequence[str] | None = None) -> int:
    """Exit code: that of generated.run()."""

    def make() -> dict[str, str]:
        return {path.relative_to(generated.ROOT).as_posix(): text for path, text in generated_files().items()}

    return generated.run("wificnc.board.generate", __doc__, make, argv)


if __name__ == "__main__":
    sys.exit(main())
