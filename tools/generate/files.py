"""Files that are made from others and lie in the repository: compare and write them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

Texts = Mapping[str, str]  # path in the repository -> text


def with_region(text: str, name: str, lines: str) -> str:
    """A hand-written file with new lines in one place: between the line that says `generated: NAME` and the next one
    that says `generated: end`.

    Raises ValueError when the file does not have exactly one such place.
    """
    place = re.compile(
        rf"(^[^\n]*\bgenerated: {re.escape(name)}\b[^\n]*\n)(.*?)(^[^\n]*\bgenerated: end\b)", re.DOTALL | re.M
    )
    found = place.findall(text)
    if len(found) != 1:
        raise ValueError(f"expected one region 'generated: {name}' with its 'generated: end', found {len(found)}")
    return place.sub(lambda match: match[1] + lines + match[3], text)


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
