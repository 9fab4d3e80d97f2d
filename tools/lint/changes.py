"""Files of changes/: a kind that towncrier knows, and at most two sentences, so that CHANGELOG.md stays readable."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lint.problem import Problem, tracked_files

FOLDER = Path("changes")
KINDS = ("added", "changed", "removed", "fixed")
MOST_SENTENCES = 2
END = re.compile(r"[.!?](?=\s+[A-Z`$\"]|\s*$)")
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|etc|vs)\.")


def check_changes(root: Path) -> list[Problem]:
    """All files of the folder but its README."""
    paths = [path for path in tracked_files(root) if path.parent == FOLDER and path.name != "README.md"]
    return [problem for path in paths for problem in check_change(path, (root / path).read_text(encoding="utf-8"))]


def check_change(path: Path, text: str) -> Iterator[Problem]:
    """One file."""
    name = path.name.split(".")
    if len(name) != 3 or not name[0].startswith("+") or name[1] not in KINDS or name[2] != "md":
        yield Problem(path, 1, f"call it +NAME.KIND.md; kinds are {', '.join(KINDS)}")
    sentences = len(END.findall(ABBREVIATION.sub("", " ".join(text.split()))))
    if not 1 <= sentences <= MOST_SENTENCES:
        yield Problem(path, 1, f"{sentences} sentences; write one or two, for users")
