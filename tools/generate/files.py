"""Files that are made from others and lie in the repository: compare and write them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

Texts = Mapping[str, str]  # path in the repository -> text


def stale(texts: Texts, root: Path) -> list[str]:
    """Paths below root whose file differs from its text."""
    return [path for path, text in texts.items() if _read(root / path) != text]


def write(texts: Texts, root: Path) -> list[str]:
    """Write those that differ, so that nothing is rebuilt for nothing. @return their paths"""
    old = stale(texts, root)
    for path in old:
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(texts[path], encoding="utf-8", newline="\n")
    return old


def _read(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None
