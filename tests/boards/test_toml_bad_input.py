"""TOML files that no editor writes, and those of one that does: board files, machine profiles, settings."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board.load import check_board, load_board
from wificnc.files.problem import FileProblems
from wificnc.files.tomlfile import read_toml


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


PIN = 'must be a pin in quotes, like "GPIO4", or a table like { pin = "GPIO4" }'


@pytest.mark.parametrize(
    ("good", "bad", "said"),
    [
        ('dir = "GPIO33"', "dir = 33", f"axis.x.dir: {PIN}, not 33"),
        ('dir = "GPIO33"', "dir = true", f"axis.x.dir: {PIN}, not true"),
        ('dir = "GPIO33"', 'dir = ["GPIO33"]', f"axis.x.dir: {PIN}"),
        ('dir = "GPIO33"', "dir = { pin = 33 }", "axis.x.dir.pin: must be text in quotes, not 33"),
        ("flash_mb = [4, 8, 16]", "flash_mb = 4", "memory.flash_mb: must be a list in brackets, not 4"),
        ("timer_hz = 20_000_000", 'timer_hz = "20 MHz"', "timing.timer_hz: must be a whole number, not '20 MHz'"),
        ("[led]", "[[led]]", "led: must be a table"),
    ],
)
def test_a_value_of_another_kind_is_said_in_words_of_the_file(tmp_path: Path, good: str, bad: str, said: str) -> None:
    text = load_board("esp32-wroom32").path.read_text(encoding="utf-8")
    assert text.count(good) == 1
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(good, bad), encoding="utf-8")
    [problem] = check_board(path)
    line = text[: text.index(good)].count("\n") + 1
    assert str(problem).splitlines()[0].startswith(f"{path}:{line}: {said} ["), problem
