"""Files that are made from others and lie in the repository: `python -m MODULE [--check]` of every generator."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def stale(texts: Mapping[str, str], root: Path = ROOT) -> list[str]:
    """Paths below root whose file is not what it would be now."""
    return [path for path, text in texts.items() if _read(root / path) != text]


def run(
    module: str, doc: str | None, make: Callable[[], Mapping[str, str]], argv: Sequence[str] | None, root: Path = ROOT
) -> int:
    """A generator's main. make: path below root -> text.

    Returns:
        0: the files are fresh (now); 1: --check found a stale one.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=doc)
    parser.add_argument("--check", action="store_true", help="write nothing, fail if a file is stale")
    check: bool = parser.parse_args(argv).check
    texts = make()
    old = stale(texts, root)
    for path in old:
        if check:
            print(f"{path} is stale: run python -m {module}", file=sys.stderr)
            continue
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(texts[path], encoding="utf-8", newline="\n")
        print(f"wrote {path}", file=sys.stderr)
    return 1 if check and old else 0


def _read(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None
