"""How messages show a path."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def shown(path: Path) -> str:
    """A path as a message shows it: relative to the working directory or the repository where it lies inside."""
    resolved = path.resolve()
    for base in (Path.cwd(), ROOT):
        if resolved.is_relative_to(base):
            return resolved.relative_to(base).as_posix()
    return path.as_posix()
