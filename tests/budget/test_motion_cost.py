"""What motion costs from a block to the step, and that no call of it is long: counted here, on MIPS and on Xtensa."""

from __future__ import annotations

import json
import os
import shutil

import mips.count
import pytest
import xtensa_programs.count
from bench.motion_cost import MIPS_BUDGET, XTENSA, XTENSA_BUDGET, here, on_mips, on_xtensa
from slow import deep_but


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("valgrind") is None and "CI" not in os.environ, reason="needs valgrind (apt-get install valgrind)"
)
def test_motion_keeps_its_budget_of_instructions() -> None:
    over = [figure for figure in here() if not figure.is_met]
    assert not over, over


@pytest.mark.slow
@pytest.mark.skipif(mips.count.not_here() != "", reason=mips.count.not_here())
def test_motion_keeps_its_budget_on_mips() -> None:
    figures = on_mips()
    assert {figure.name for figure in figures} == set(json.loads(MIPS_BUDGET.read_text(encoding="utf-8"))) - {"about"}
    assert [figure for figure in figures if not figure.is_met or figure.value <= 0] == []


@pytest.mark.slow
@pytest.mark.skipif(xtensa_programs.count.not_here() != "", reason=xtensa_programs.count.not_here())
@pytest.mark.parametrize("chip", deep_but("esp32".__eq__, XTENSA))  # the same code, of another clock
def test_motion_keeps_its_budget_on_xtensa(chip: str) -> None:
    figures = on_xtensa(chip)
    assert {figure.name for figure in figures} == set(json.loads(XTENSA_BUDGET.read_text(encoding="utf-8"))[chip])
    assert [figure for figure in figures if not figure.is_met or figure.value <= 0] == []
