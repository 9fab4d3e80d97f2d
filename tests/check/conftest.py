"""`wificnc check` as a process would run it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from wificnc.app import main

# 6000 mm/min and 500 mm/s2 on X and Y, 600 mm/min on Z; travel 200, 100, 50.
MACHINE = """
schema = 1
name = "Bench"
[axis.x]
steps_per_mm = 100
max_rate_mm_min = 6000
acceleration_mm_s2 = 500
travel_mm = 200
[axis.y]
steps_per_mm = 100
max_rate_mm_min = 6000
acceleration_mm_s2 = 500
travel_mm = 100
[axis.z]
steps_per_mm = 100
max_rate_mm_min = 600
acceleration_mm_s2 = 500
travel_mm = 50
"""


@pytest.fixture
def check(tmp_path: Path, capsys):
    """Check a job on the machine above (or another): exit code and the JSON document."""

    def run(job: str, *args: str, machine: str | None = MACHINE) -> tuple[int, dict[str, Any]]:
        (tmp_path / "bench.toml").write_text(machine or "")
        (tmp_path / "job.nc").write_text(job)
        on = ["--machine", str(tmp_path / "bench.toml")] if machine else []
        with pytest.raises(SystemExit) as ended:
            main(["check", str(tmp_path / "job.nc"), *on, "--json", *args])
        code = ended.value.code
        return int(code or 0), json.loads(capsys.readouterr().out)

    return run


@pytest.fixture
def kinds():
    """(kind, first line, last line) of the findings of a report."""
    return lambda report: [(f["kind"], f["first_line"], f["last_line"]) for f in report["findings"]]
