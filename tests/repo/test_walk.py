"""The walk of one G1 in docs/ARCHITECTURE.md is true: its functions are there, and each row hands over to another."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "ARCHITECTURE.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (\d+) \| `([^`]+)` \| `(\w+)\(\)` \| [^|]+ \| (?:(\d+), `(\w+)`)? ?\|$", re.MULTILINE)
MAX_FILES = 15
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)


@dataclass(frozen=True)
class Row:
    number: int
    file: str
    function: str
    source: int  # the row that hands over; 0: the first row
    name: str  # by which


ROWS = [Row(int(n), file, function, int(source or 0), name) for n, file, function, source, name in ROW.findall(TEXT)]
LATER = ROWS[1:]


def code(file: str) -> str:
    return COMMENT.sub("", (ROOT / file).read_text(encoding="utf-8"))


def test_the_walk_is_short_and_opens_each_file_once() -> None:
    section = TEXT.split("## One G1 from the byte to the pin")[1].split("\n## ")[0]
    assert len(ROWS) == len(re.findall(r"^\| \d+ \|", section, re.MULTILINE))
    assert [row.number for row in ROWS] == list(range(1, len(ROWS) + 1))
    assert len({row.file for row in ROWS}) == len(ROWS) <= MAX_FILES


def test_it_begins_at_a_port_and_ends_at_a_pin() -> None:
    assert "U3RXREG" in code(ROWS[0].file)
    assert "step_lines_invert(" in code(ROWS[-1].file)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.function)
def test_its_function_is_defined_there(row: Row) -> None:
    head = rf"^[A-Za-z_][\w \t*]*[ *]{row.function}\([^;{{}}]*\) \{{"
    assert re.search(head, code(row.file), re.MULTILINE)


@pytest.mark.parametrize("row", LATER, ids=lambda row: row.function)
def test_the_row_before_hands_over(row: Row) -> None:
    assert 0 < row.source < row.number
    for file in (ROWS[row.source - 1].file, row.file):
        assert re.search(rf"\b{row.name}\b", code(file)), f"{row.name} is not in {file}"


def test_all_rows_lead_to_the_pin() -> None:
    """But for the two that return the command to the row that asked for it."""
    row, chain = ROWS[-1], [ROWS[-1]]
    while row.source:
        row = ROWS[row.source - 1]
        chain.append(row)
    assert chain[-1] == ROWS[0]
    assert [row.function for row in ROWS if row not in chain] == ["gcode_plain_line", "gcode_parse_plain"]
