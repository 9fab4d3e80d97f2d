"""Regions that generators write into hand-written files."""

from __future__ import annotations

from pathlib import Path

import pytest
from generate.__main__ import main
from generate.files import with_region
from wificnc.tables.settings import parse_settings

TEXT = "before\n# generated: list, by a generator\nold\nlines\n# generated: end\nafter\n"


def test_only_the_region_changes() -> None:
    assert with_region(TEXT, "list", "new\n") == TEXT.replace("old\nlines\n", "new\n")


def test_a_region_may_be_empty_and_filled_again() -> None:
    assert with_region(with_region(TEXT, "list", ""), "list", "old\nlines\n") == TEXT


@pytest.mark.parametrize(
    "text",
    [
        "no region\n",
        TEXT.replace("generated: end", "the end"),
        TEXT.replace("generated: list", "generated: lists"),
        TEXT + TEXT,
    ],
    ids=["none", "no end", "another name", "two"],
)
def test_a_file_without_exactly_one_region_is_an_error(text: str) -> None:
    with pytest.raises(ValueError, match="generated: list"):
        with_region(text, "list", "new\n")


def test_a_fault_in_a_table_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken(root: Path) -> dict[str, str]:
        parse_settings("schema = 1\n[[setting]]\nnumber = 1\n")
        return {}

    monkeypatch.setattr("generate.__main__.GENERATORS", (broken,))
    assert main([]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: SettingsTable: setting.0.name: Field required\n") and "Traceback" not in said
