"""What motion costs from a block to the step, and that no call of it is long: counted here and on MIPS."""

from __future__ import annotations

import json
import os
import shutil

import pytest
from bench.motion_cost import BUDGET, here, on_mips
from mips.count import not_here


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("valgrind") is None and "CI" not in os.environ, reason="needs valgrind (apt-get install valgrind)"
)
def test_motion_keeps_its_budget_of_instructions() -> None:
    over = [figure for figure in here() if not figure.is_met]
    assert not over, over


@pytest.mark.slow
@pytest.mark.skipif(not_here() != "", reason=not_here())
def test_motion_keeps_its_budget_on_mips() -> None:
    figures = on_mips()
    assert {figure.name for figure in figures} == set(json.loads(BUDGET.read_text(encoding="utf-8"))) - {"about"}
    assert [figure for figure in figures if not figure.is_met or figure.value <= 0] == []
