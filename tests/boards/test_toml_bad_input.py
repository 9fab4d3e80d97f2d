"""TOML files that no editor writes, and those of one that does: board files, machine profiles, settings."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board.load import check_board, load_board
from wificnc.checked.problem import FileProblems
from wificnc.checked.tomlfile import read_toml


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
        ("a = " + "{b = " * 5000 + "1" + "}" * 5000, "nested too deeply"),
        ("".join(f"k{n} = 1\n" for n in range(200_000)), "too large"),
    ],
    ids=["arrays", "tables", "large"],
)
def test_what_nobody_writes_by_hand_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "file.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileProblems, match=said):
        read_toml(path)


def test_the_mark_that_windows_editors_begin_a_file_with_is_no_part_of_it(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_text(load_board("esp32-wroom32").path.read_text(encoding="utf-8"), encoding="utf-8-sig")
    assert check_board(path) == []
