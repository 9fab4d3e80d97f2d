"""docs/ARCHITECTURE.md names every room of the repository, and none that is gone; and the command has its layers."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "ARCHITECTURE.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"(?:`|\*\*)([\w/]+)(?:`|\*\*)", TEXT))

COMMAND = ROOT / "cli" / "wificnc"
TABLE = TEXT[TEXT.index("| package | what it does |") :].partition("\n\n")[0]
ROWS = re.findall(r"^\| (`.*?`) \|", TABLE, re.MULTILINE)
PACKAGES = [name for row in ROWS for name in re.findall(r"`([\w/]+)`", row)]
LAYERS = list(dict.fromkeys(name.partition("/")[0] for name in PACKAGES))


def rooms(folder: str) -> set[str]:
    """Folders with sources."""
    found = (path for path in (ROOT / folder).iterdir() if path.is_dir() and any(path.rglob("*.*")))
    return {path.name for path in found if not path.name.startswith(("_", "."))} - {"__pycache__"}


def imported(path: Path) -> Iterator[str]:
    """Packages of the command that a module imports, those that it imports within a function, too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("wificnc."):
            yield from (f"{node.module}.{name.name}".split(".")[1] for name in node.names)
        elif isinstance(node, ast.Import):
            yield from (name.name.split(".")[1] for name in node.names if name.name.startswith("wificnc."))


@pytest.mark.parametrize("folder", ["core", "targets", "cli/wificnc", "tools"])
def test_every_room_is_named(folder: str) -> None:
    assert rooms(folder) - {name.rsplit("/", 1)[-1] for name in NAMED} == set()


def test_no_folder_is_named_that_is_gone() -> None:
    paths = re.findall(r"(?:core|targets|cli|tools|tests)/[\w/.]*\w", TEXT)
    assert paths and [path for path in paths if not (ROOT / path).exists() and "<" not in path] == []


def test_the_command_has_the_packages_of_the_table() -> None:
    packages = {path.parent.relative_to(COMMAND).as_posix() for path in COMMAND.rglob("__init__.py")} - {"."}
    assert packages == set(PACKAGES)


@pytest.mark.parametrize("package", LAYERS)
def test_a_package_of_the_command_imports_those_above_it(package: str) -> None:
    names = {name for path in (COMMAND / package).rglob("*.py") for name in imported(path)}
    assert names & set(LAYERS) <= set(LAYERS[: LAYERS.index(package) + 1])


def milliseconds(name: str) -> int:
    """A constant of core/segment/ahead.h."""
    match = re.search(rf"#define {name} +(\d+)u", (ROOT / "core/segment/ahead.h").read_text(encoding="utf-8"))
    assert match
    return int(match[1]) // 1000


def test_its_times_are_those_of_the_code() -> None:
    names = ("FAR", "FULL", "LEAST", "NEAR", "SOON")
    far, full, least, near, soon = (milliseconds(f"AHEAD_{name}_US") for name in names)
    text = " ".join(TEXT.split())
    assert f"{far} ms are committed, or {full} while homing, probing, with a shaper or from a host" in text
    assert f"when {least} ms are left" in text
    assert f"made some {1000 // (far - least)} times a second" in text
    assert f"only {near // 2} to {near} ms are committed" in text
    assert f"follows the spindle is committed for {soon // 2} to {soon} ms only" in text
    assert f"at least {milliseconds('AHEAD_BRANCH_US')} ms ahead of the pins" in text
