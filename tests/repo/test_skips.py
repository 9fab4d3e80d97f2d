"""CI counts its skips: what was to be installed and is missing is a failure there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from skips import VARIABLE

TESTS = Path(__file__).resolve().parents[1]
PROGRAM = """
import pytest

def test_it():
    pytest.skip({reason!r})

@pytest.mark.skipif(True, reason={reason!r})
def test_by_mark():
    pass

@pytest.mark.xfail(reason="another thing")
def test_xfail():
    assert False
"""


def outcome(folder: Path, text: str, value: str) -> tuple[int, str]:
    """Run a test file with this tree's conftest; exit code and output."""
    (folder / "conftest.py").write_text((TESTS.parent / "conftest.py").read_text())
    (folder / "test_one.py").write_text(text)
    environment = {**os.environ, VARIABLE: value, "PYTHONPATH": str(TESTS / "support")}
    argv = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-c",
        os.devnull,
        str(folder / "test_one.py"),
    ]
    run = subprocess.run(argv, cwd=folder, env=environment, capture_output=True, text=True)
    return run.returncode, run.stdout


@pytest.mark.parametrize(("value", "code"), [("", 0), ("0", 0), ("1", 1)])
def test_a_tool_that_is_missing_fails_where_it_must_be_there(tmp_path: Path, value: str, code: int) -> None:
    got, said = outcome(tmp_path, PROGRAM.format(reason="there is no Chromium on this computer"), value)
    assert got == code, said
    assert ("1 failed, 1 xfailed, 1 error" if code else "2 skipped, 1 xfailed") in said


def test_the_closing_lines_say_what_brings_tests_back(tmp_path: Path) -> None:
    _, said = outcome(tmp_path, PROGRAM.format(reason="there is no Chromium here: apt-get install chromium"), "")
    assert "2 skipped: there is no Chromium here: apt-get install chromium\n" in said


def test_what_is_on_the_list_is_skipped(tmp_path: Path) -> None:
    got, said = outcome(tmp_path, PROGRAM.format(reason="this kernel has no netem (Error)"), "1")
    assert got == 0 and "2 skipped" in said


def test_a_file_that_is_skipped_whole_fails_too(tmp_path: Path) -> None:
    got, said = outcome(tmp_path, "import pytest\npytest.importorskip('nowhere_to_be_had')\n", "1")
    assert got != 0 and "could not import 'nowhere_to_be_had'" in said
