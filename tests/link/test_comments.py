"""Comments that stay in a line on its way to a controller: the cases of protocol/vectors/comments.json, which the
page's tests pass, too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from wificnc.connection.typed import kept_comment, typed_line
from wificnc.errors import JobError, UserError
from wificnc.job.program import LONGEST_LINE, code_of, read_program, ready

VECTORS = Path(__file__).resolve().parents[2] / "protocol" / "vectors" / "comments.json"
CASES = json.loads(VECTORS.read_text(encoding="utf-8"))["cases"]


@pytest.mark.parametrize("case", CASES, ids=[case["line"][:40] for case in CASES])
def test_the_comment_that_stays(case: dict[str, Any]) -> None:
    code = code_of(case["line"].encode()).decode()
    assert kept_comment(case["line"], code) == case["comment"]
    if case["typed"]:
        assert typed_line(case["line"]).decode().rstrip().endswith(case["comment"])
    else:
        with pytest.raises(UserError):
            typed_line(case["line"])


@pytest.mark.parametrize("case", CASES, ids=[case["line"][:40] for case in CASES])
def test_the_line_of_a_job(case: dict[str, Any]) -> None:
    if case["job"] is None:
        with pytest.raises(JobError, match=r"job\.nc:1"):
            read_program("job.nc", case["line"].encode())
        return
    (line,) = ready(read_program("job.nc", case["line"].encode()).lines, longest=LONGEST_LINE)
    assert line.wire == case["job"].encode() + b"\n"
