"""An object that is taken from an earlier run is the one that would be compiled now."""

from __future__ import annotations

from pathlib import Path

import pytest
from xtensa.unchanged import depfile, is_unchanged, note

COMMAND = ["clang", "-O2", "one.c"]


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """An object, with the list of files that a compiler writes."""
    for name in ("one.o", "one.c", "one.h"):
        (tmp_path / name).write_text(name)
    made = tmp_path / "one.o"
    depfile(made).write_text(f"one.ll: {tmp_path}/one.c \\\n  {tmp_path}/one.h\n")
    note(made, COMMAND)
    return made


def test_the_same_bytes_by_the_same_command_need_no_compiling(made: Path) -> None:
    made.with_name("one.h").write_text("one.h")  # generated again
    assert is_unchanged(made, COMMAND)


@pytest.mark.parametrize("name", ["one.c", "one.h"])
def test_a_change_of_what_was_read_is_seen(made: Path, name: str) -> None:
    made.with_name(name).write_text("other")
    assert not is_unchanged(made, COMMAND)


@pytest.mark.parametrize("name", ["one.o", "one.h", "one.sha256", "one.d"])
def test_what_is_missing_is_made(made: Path, name: str) -> None:
    made.with_name(name).unlink()
    assert not is_unchanged(made, COMMAND)


def test_another_command_compiles(made: Path) -> None:
    assert not is_unchanged(made, [*COMMAND, "-DOTHER"])
