"""`make test-all` and `make test-deep` run every test there is, and who names these commands is right."""

from __future__ import annotations

import ast
import re
from fnmatch import fnmatch

import pytest
from rings import PLACES, ROOT, TESTS, files_of_tests, name_of

DEAR = {"pytest.mark.deep"}


def test_no_folder_of_tests_is_left_out(pytestconfig: pytest.Config) -> None:
    """pytest leaves out folders by their names, without a word."""
    folders = {part for path in files_of_tests() for part in name_of(path).split("/")[:-1]}
    patterns = pytestconfig.getini("norecursedirs")
    assert "build" in folders
    assert [folder for folder in sorted(folders) for pattern in patterns if fnmatch(folder, pattern)] == []


def test_both_places_are_collected(pytestconfig: pytest.Config) -> None:
    assert pytestconfig.getini("testpaths") == [str(tests.relative_to(ROOT)) for tests in PLACES]


def quick_tests(text: str) -> list[str]:
    """Names of tests without the marker; one that has it for some parameters only has quick ones (slow_but)."""
    body = ast.parse(text).body
    marked = {
        ast.unparse(node.value) for node in body if isinstance(node, ast.Assign) and "pytestmark" in ast.dump(node)
    }
    tests = [node for node in body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    return [node.name for node in tests if not DEAR & {*marked, *map(ast.unparse, node.decorator_list)}]


def test_every_folder_has_quick_tests() -> None:
    folders = {path.parent for path in files_of_tests()} - {TESTS / "native" / "test_core"}
    for folder in sorted(folders - {TESTS / "native"}):  # PlatformIO's, which tests/build runs
        found = [name for path in folder.glob("test_*.py") for name in quick_tests(path.read_text(encoding="utf-8"))]
        assert found, f"{folder.relative_to(ROOT)}: CI runs nothing of it"


def test_the_marker_is_seen() -> None:
    assert quick_tests("@pytest.mark.deep\n@other(1)\ndef test_a(): ...\n\n\ndef test_b(): ...\n") == ["test_b"]
    assert quick_tests("pytestmark = pytest.mark.deep\n\n\ndef test_a(): ...\n") == []


def recipe(target: str) -> str:
    """What the Makefile does for it."""
    found = re.search(
        rf"^(?:\S+ )*{target}(?: \S+)*:[^=\n]*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE
    )
    assert found, target
    return found[1]


def test_ci_runs_all_of_it_by_a_command_of_the_readme() -> None:
    readme, ci = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", ".ci/run"))
    assert re.findall(r"\b(make test\S*) [2>]", ci) == ["make test-all"]
    assert set(re.findall(r"^(make test\S*) +#", readme, re.MULTILINE)) == {"make test", "make test-all"}


def test_only_a_command_leaves_tests_out(pytestconfig: pytest.Config) -> None:
    """So that a file that is run by its name runs whole."""
    commands = ("test", "test-all", "test-slice", "test-deep")
    assert len({recipe(name) for name in commands}) == 1 and "$(DEV) $@ " in recipe("test")
    assert not re.search("slow|deep|core", str(pytestconfig.getini("addopts")))


@pytest.mark.parametrize("target", ["test", "test-all", "test-slice", "test-deep"])
def test_help_and_document_name_both(target: str) -> None:
    assert re.search(rf"make {target}  ", recipe("help"))
    assert f"| `make {target}` |" in (ROOT / "docs" / "development.md").read_text(encoding="utf-8")
