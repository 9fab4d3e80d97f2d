"""chip_differences.toml: which tests run on the chip at any time, and which cannot hold there, and why."""

from __future__ import annotations

import sys
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@cache
def declared() -> dict[str, Any]:
    return tomllib.loads((Path(__file__).parent / "chip_differences.toml").read_text(encoding="utf-8"))


@cache
def always() -> frozenset[str]:
    """file::test, without parameters."""
    return frozenset(declared()["always"])


def difference(name: str) -> str | None:
    """Why a test, file::test[parameters], does not hold on the chip; None: it must."""
    plain = name.replace("[", "(").replace("]", ")")  # brackets are a pattern's
    for row in declared()["difference"]:
        if any(fnmatchcase(plain, test.replace("[", "(").replace("]", ")")) for test in row["tests"]):
            return str(row["reason"])
    return None
