"""Where the repository keeps boards and pin tables, seen from the package."""

from __future__ import annotations

from wificnc.checked.paths import ROOT
from wificnc.errors import UserError

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
