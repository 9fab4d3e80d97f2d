"""A file of changes/ is one or two sentences of a known kind; towncrier knows the same kinds."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from lint.changes import FOLDER, KINDS, check_change, check_changes
from tools_here import needs_git
from wificnc.build.checkout import checkout_root

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("+jog.fixed.md", "One. Two. Three."),
        ("+jog.fixed.md", "No end"),
        ("+jog.fixed.md", ""),
        ("+jog.mended.md", "One."),
        ("jog.fixed.md", "One."),
        ("+jog.md", "One."),
        ("+jog.fixed.txt", "One."),
    ],
)
def test_a_change_in_another_form_is_found(name: str, text: str) -> None:
    assert [problem.path for problem in check_change(FOLDER / name, text)] == [FOLDER / name]


@pytest.mark.parametrize("text", ["`$12` may be 0.0005.", "The page runs v1.2 files, e.g. one.nc. It stops\nat M30.\n"])
def test_one_or_two_sentences_are_good(text: str) -> None:
    assert list(check_change(FOLDER / "+jog.added.md", text)) == []


@needs_git
def test_those_of_the_tree_are_good() -> None:
    assert check_changes(checkout_root()) == []


def test_towncrier_has_the_same_kinds() -> None:
    table = tomllib.loads(Path(checkout_root(), "pyproject.toml").read_text(encoding="utf-8"))["tool"]["towncrier"]
    assert tuple(kind["directory"] for kind in table["type"]) == KINDS
