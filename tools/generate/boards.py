"""What git keeps of the text about boards. None of it has a board's name, so that a new board is one file."""

from __future__ import annotations

from pathlib import Path

from generate.board_docs import readme_texts
from generate.board_start import start_texts


def texts(root: Path) -> dict[str, str]:
    """Path in the repository -> text. Raises ValueError for a hand-written file without its region."""
    return {**readme_texts(root), **{f"docs/start/{name}": text for name, text in start_texts().items()}}
