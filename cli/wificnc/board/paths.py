"""Where the repository keeps boards and pin tables, seen from the package."""

from __future__ import annotations

from wificnc.errors import UserError
from wificnc.files.paths import ROOT

BOARDS = ROOT / "boards"
TARGETS = ROOT / "targets"
DOCS = ROOT / "docs"


def require_repository() -> None:
    """A checkout has the data, and so has an installed package.

    Raises:
        UserError: boards/ or targets/ is missing: someone moved the package's files.
    """
    if not (BOARDS.is_dir() and TARGETS.is_dir()):
        raise UserError(f"no boards/ and targets/ in {ROOT}", "this installation is damaged: install wificnc again")
