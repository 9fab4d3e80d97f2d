"""Numbers are Grbl's, words are ours."""

from __future__ import annotations

from ctypes import CDLL

from gcode_core import status_table

GRBL = {0, *range(1, 18), *range(20, 39)}  # 18 and 19 are unused


def test_every_number_has_its_own_words(lib: CDLL) -> None:
    table = status_table()
    assert {number for number in table if number < 100} == GRBL
    for number, (_, words) in table.items():
        assert lib.status_text(number).decode() == words
    assert len({words for _, words in table.values()}) == len(table)


def test_other_numbers_are_unknown(lib: CDLL) -> None:
    for number in (-1, 18, 19, 39, 99, 1000):
        assert lib.status_text(number) == b"unknown status"
