"""protocol/tmc.toml: each kind has its row with the currents of its data sheet; a row that cannot be is refused."""

from __future__ import annotations

import math
from typing import get_args

import pytest
from wificnc.board.buses import Driver
from wificnc.tables.tmc import TMC_PATH, load_tmcs, parse_tmcs


def test_each_kind_of_a_board_file_has_a_row() -> None:
    rows = load_tmcs().chip
    assert sorted(row.kind for row in rows) == sorted(get_args(Driver.model_fields["kind"].annotation))
    assert [load_tmcs().number(row.kind) for row in rows] == list(range(1, len(rows) + 1))


@pytest.mark.parametrize(
    ("kind", "sense_mohm", "rms_a", "source"),
    [
        ("tmc2209", 110, 1.77, "data sheet, 9: RSENSE 0.11, vsense 0: 1.77 A"),
        ("tmc2209", 220, 0.96, "the same formula with 0.22"),
        ("tmc2130", 110, 1.74, "data sheet, 9: (0.32 V / 0.13 Ohm) / sqrt 2"),
        ("tmc5160", 75, 3.06, "data sheet, 9: RSENSE 0.075, global scaler 256: 3.06 A"),
    ],
)
def test_the_most_current_is_that_of_the_data_sheet(kind: str, sense_mohm: int, rms_a: float, source: str) -> None:
    most_ma = load_tmcs().of(kind).current_max_ma(sense_mohm)
    assert math.isclose(most_ma / 1000, rms_a, abs_tol=0.006), source


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('kind = "tmc2209"', 'kind = "TMC2209"'),
        ("sense_mohm = 110", "sense_mohm = 0"),
        ("full_mv = 325", "full_mv = 0.325"),
        ("fine_mv = 180", "fine_mv = -1"),
        ("sense_more_mohm = 20", "sense_more_mohm = 256"),
        ("full_mv = 325", "full_mv = 325\nfull_scale = 1"),
    ],
)
def test_a_row_that_cannot_be_is_refused(old: str, new: str) -> None:
    text = TMC_PATH.read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(ValueError, match=r"chip\.0"):
        parse_tmcs(text.replace(old, new, 1))
