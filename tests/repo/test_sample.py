"""CI runs some cases of each test, always the same ones; its slices run the others."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from sample import sampled

CASES = [f"tests/a/test_x.py::test_many[{n}]" for n in range(20)]
ONE = "tests/a/test_x.py::test_one"
CLASS = ["tests/a/test_x.py::TestIt::test_many[1]", "tests/a/test_x.py::TestIt::test_many[2]"]


def test_each_test_stays_and_no_test_has_more() -> None:
    found = sampled([ONE, *CASES, *CLASS], 4)
    assert {ONE, CASES[0], *CLASS} <= found
    assert len(found & set(CASES)) == 4


def test_one_case_more_changes_at_most_one() -> None:
    before, after = sampled(CASES[1:], 4), sampled(CASES, 4)
    assert len(after - before) <= 2  # the first one, and none or one by its checksum
    assert sampled(reversed(CASES[1:]), 19) == set(CASES[1:])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--cases=3"], "4 passed, 7 deselected"),
        (["--cases=0"], "11 passed"),
        (["--cases-of-ci", "-m", "not deep"], "4 passed, 7 deselected"),
        (["--cases-of-ci", "-m", "deep"], "7 passed, 4 deselected"),
        (["-m", "not deep"], "10 passed, 1 deselected"),
        (["--cases-of-ci", "--slice=0/1"], "7 passed, 4 deselected"),
    ],
)
def test_pytest_runs_the_sample(options: list[str], said: str, tmp_path: Path) -> None:
    """And says how many it left out."""
    tests = Path(__file__).parents[1]
    (tmp_path / "conftest.py").write_bytes((tests.parent / "conftest.py").read_bytes())
    (tmp_path / "pytest.ini").write_text(f"[pytest]\npythonpath = {tests / 'support'}\n", encoding="utf-8")
    many = "import pytest\ndeep = pytest.param(9, marks=pytest.mark.deep)\n"
    many += "@pytest.mark.alike(3)\n@pytest.mark.parametrize('n', [*range(9), deep])\ndef test_many(n):\n    pass\n"
    (tmp_path / "test_it.py").write_text(many + "def test_one():\n    pass\n")
    argv = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *options]
    run = subprocess.run(argv, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert said in run.stdout, run.stdout + run.stderr
