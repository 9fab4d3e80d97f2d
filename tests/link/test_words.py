"""The error texts: one home, one copy."""

from __future__ import annotations

from pathlib import Path

import pytest
from generate import words
from generate.__main__ import run
from generate.words import ALARMS_SOURCE, OUTPUT, SOURCE, read_alarms, read_rows, words_text
from wificnc.connection.alarms import alarm_words
from wificnc.connection.client import error_words
from wificnc.connection.words import ALARMS, ERRORS, NEEDS_RESET

ROOT = Path(__file__).resolve().parents[2]


def test_copy_is_fresh() -> None:
    assert words_text((ROOT / SOURCE).read_text(), (ROOT / ALARMS_SOURCE).read_text()) == (ROOT / OUTPUT).read_text()


def test_words() -> None:
    assert error_words(22) == f"error:22 {ERRORS[22]}"
    assert error_words(999) == "error:999 unknown error"
    assert 0 not in ERRORS


ALARM_LINE = 'ALARM(7, DOOR, RESET,\n      "some \\"other\\" text")\n'


def test_alarms() -> None:
    assert alarm_words(5) == ALARMS[5]
    assert alarm_words(99) == "unknown alarm"
    assert set(NEEDS_RESET) < set(ALARMS)


@pytest.mark.parametrize("number", ALARMS)
def test_an_alarm_says_the_way_out_without_a_command_line(number: int) -> None:
    """The page shows these texts, on a phone, too; what to type is in connection/condition.py."""
    assert "wificnc" not in ALARMS[number]


def test_an_alarm_that_cannot_be_read_is_not_left_out() -> None:
    assert [row.number for row in read_alarms(ALARM_LINE)] == [7]
    with pytest.raises(ValueError, match="cannot be read"):
        read_alarms(ALARM_LINE + "ALARM(8, OTHER)\n")


def test_stale_copy_is_found_and_mended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / SOURCE).parent.mkdir(parents=True)
    (tmp_path / OUTPUT).parent.mkdir(parents=True)
    (tmp_path / ALARMS_SOURCE).parent.mkdir(parents=True)
    (tmp_path / ALARMS_SOURCE).write_text(ALARM_LINE + 'ALARM(9, ESTOP, RESET, "x")\n')
    (tmp_path / SOURCE).write_text('X(0, OK, "ok") X(7, NEW, "some \\"new\\" text")')
    assert run([words.texts], tmp_path, check=True) == 1
    assert "is stale" in capsys.readouterr().err
    assert run([words.texts], tmp_path) == 0
    assert run([words.texts], tmp_path, check=True) == 0
    assert '7: "some \\"new\\" text"' in (tmp_path / OUTPUT).read_text()


def test_a_row_over_two_lines_is_a_row() -> None:
    assert read_rows('    X(1, A, "one") \\\n    X(2, B, \\\n      "two")') == [(1, '"one"'), (2, '"two"')]


def test_no_table() -> None:
    with pytest.raises(ValueError, match="no status table"):
        words_text("", ALARM_LINE)
