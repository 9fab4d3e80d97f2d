"""docs/ARCHITECTURE.md names every room of the repository, and none that is gone."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "ARCHITECTURE.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"(?:`|\*\*)([\w/]+)(?:`|\*\*)", TEXT))


def rooms(folder: str) -> set[str]:
    """Folders with sources."""
    found = (path for path in (ROOT / folder).iterdir() if path.is_dir() and any(path.rglob("*.*")))
    return {path.name for path in found if not path.name.startswith(("_", "."))} - {"__pycache__"}


@pytest.mark.parametrize("folder", ["core", "targets", "cli/wificnc", "tools"])
def test_every_room_is_named(folder: str) -> None:
    assert rooms(folder) - {name.rsplit("/", 1)[-1] for name in NAMED} == set()


def test_no_folder_is_named_that_is_gone() -> None:
    paths = re.findall(r"(?:core|targets|cli|tools|tests)/[\w/.]*\w", TEXT)
    assert paths and [path for path in paths if not (ROOT / path).exists() and "<" not in path] == []


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
