"""The kinds of machines, which are the choices of the setting kinematics: their C table, and the one in the docs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wificnc.tables.settings import Choice, parse_settings

from generate.files import with_region
from generate.markdown import table_text
from generate.settings import SOURCE, environment

HEADER = "core/motion/kinematics/kinds_gen.h"
TEMPLATE = "kinds_gen.h.j2"
PAGE = "docs/kinematics.md"


def page_text(page: str, kinds: Sequence[Choice]) -> str:
    """The page with its table. Raises ValueError when it has no place for that."""
    rows = [[str(value), f"`{kind.name}`", *kind.motors] for value, kind in enumerate(kinds)]
    return with_region(page, "kinds", table_text(["`$80`", "profile", "X motor", "Y motor"], rows) + "\n\n")


def texts(root: Path) -> dict[str, str]:
    """Both: path in the repository -> text. Raises ValueError, as page_text()."""
    kinds = parse_settings((root / SOURCE).read_text(encoding="utf-8"))["kinematics"].choice
    header = environment().get_template(TEMPLATE).render({"source": SOURCE, "kinds": kinds})
    return {HEADER: header, PAGE: page_text((root / PAGE).read_text(encoding="utf-8"), kinds)}
