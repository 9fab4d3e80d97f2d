"""Where the repository keeps boards and pin tables, seen from the package."""

from __future__ import annotations

from pathlib import Path

from wificnc.errors import UserError

ROOT = Path(__file__).resolve().parents[3]
BOARDS = ROOT / "boards"
TARGETS = ROOT / "targets"
DOCS = ROOT / "docs"


def require_repository() -> None:
    """The data lies beside the package only in a checkout (pip install -e .).

    Raises:
        UserError: boards/ or targets/ is not where a checkout has it.
    """
    if not (BOARDS.is_dir() and TARGETS.is_dir()):
        raise UserError(
            f"no boards/ and targets/ in {ROOT}",
            "install from a checkout: git clone, then pip install -e .",
        )


def shown(path: Path) -> str:
    """A path as a message shows it: relative to the working directory or the repository where it lies inside."""
    resolved = path.resolve()
    for base in (Path.cwd(), ROOT):
        if resolved.is_relative_to(base):
            return resolved.relative_to(base).as_posix()
    return path.as_posix()
