"""`make test` runs every test there is: pytest leaves out folders by their names, without a word."""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]


def test_no_folder_of_tests_is_left_out(pytestconfig: pytest.Config) -> None:
    folders = {part for path in TESTS.rglob("test_*.py") for part in path.relative_to(TESTS).parts[:-1]}
    patterns = pytestconfig.getini("norecursedirs")
    assert "build" in folders
    assert [folder for folder in sorted(folders) for pattern in patterns if fnmatch(folder, pattern)] == []
