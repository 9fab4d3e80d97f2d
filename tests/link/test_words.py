"""The error texts: one home, one copy."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from wificnc.link.alarms import ALARMS, alarm_words
from wificnc.link.client import error_words
from wificnc.link.generate_words import OUTPUT, SOURCE, main, read_rows, words_text
from wificnc.link.words import ERRORS

ROOT = Path(__file__).resolve().parents[2]


def test_copy_is_fresh() -> None:
    assert words_text((ROOT / SOURCE).read_text()) == (ROOT / OUTPUT).read_text()


def test_words() -> None:
    assert error_words(22) == f"error:22 {ERRORS[22]}"
    assert error_words(999) == "error:999 an error that this program does not know"
    assert 0 not in ERRORS


def test_every_alarm_of_the_core_has_words() -> None:
    header = (ROOT / "core/machine/machine.h").read_text()
    numbers = {int(number) for number in re.findall(r"\bALARM_[A-Z_]+ = (\d+)", header)} - {0}
    assert numbers
    assert numbers <= set(ALARMS)
    assert alarm_words(99) == "an alarm that this program does not know"


def test_stale_copy_is_found_and_mended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / SOURCE).parent.mkdir(parents=True)
    (tmp_path / OUTPUT).parent.mkdir(parents=True)
    (tmp_path / SOURCE).write_text('X(0, OK, "ok") X(7, NEW, "some \\"new\\" text")')
    assert main(["--check"], tmp_path) == 1
    assert "is stale" in capsys.readouterr().err
    assert main([], tmp_path) == 0
    assert main(["--check"], tmp_path) == 0
    assert '7: "some \\"new\\" text"' in (tmp_path / OUTPUT).read_text()


def test_a_row_over_two_lines_is_a_row() -> None:
    assert read_rows('    X(1, A, "one") \\\n    X(2, B, \\\n      "two")') == [(1, '"one"'), (2, '"two"')]


def test_no_table() -> None:
    with pytest.raises(ValueError, match="no status table"):
        words_text("")
