"""The cost of the hot path in instructions: counted by valgrind, the same on every run, however busy the machine."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from bench.measure import instructions

JOB = Path(__file__).resolve().parents[2] / "examples" / "relief.nc"


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("valgrind") is None and "CI" not in os.environ, reason="needs valgrind (apt-get install valgrind)"
)
def test_the_hot_path_keeps_its_budget_of_instructions() -> None:
    over = [figure for figure in instructions(JOB) if not figure.is_met]
    assert not over, over
