"""The cost of the hot path in instructions: counted by valgrind, the same on every run, however busy the machine."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from bench.measure import instructions

JOB = Path(__file__).resolve().parents[2] / "examples" / "relief.nc"
LINES = 4000


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("valgrind") is None and "CI" not in os.environ, reason="needs valgrind (apt-get install valgrind)"
)
def test_the_hot_path_keeps_its_budget_of_instructions(tmp_path: Path) -> None:
    """Each figure is of a block, a line or a segment: a third of the file has them, too."""
    part = tmp_path / "relief.nc"
    part.write_text("\n".join([*JOB.read_text(encoding="utf-8").splitlines()[:LINES], "M2"]) + "\n", encoding="utf-8")
    over = [figure for figure in instructions(part) if not figure.is_met]
    assert not over, over
