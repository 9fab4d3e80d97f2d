"""The lint that finds text without an encoding finds it, and the tree has none."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.encodings import check_encodings, check_text
from tools_here import needs_git
from wificnc.build.checkout import checkout_root


@pytest.mark.parametrize(
    "line",
    [
        "path.read_text()",
        "path.write_text(text)",
        "open(name)",
        "open(name, 'a')",
        "path.open()",
        "path.open(mode='w')",
        "subprocess.run(argv, text=True)",
    ],
)
def test_text_without_an_encoding_is_found(line: str) -> None:
    assert [problem.line for problem in check_text(Path("a.py"), f"import x\n{line}\n")] == [2]


@pytest.mark.parametrize(
    "line",
    [
        "path.read_text('utf-8')",
        "path.write_text(text, encoding='ascii')",
        "open(name, 'rb')",
        "path.open('wb')",
        "device.open(1, 2)",
        "tarfile.open(name, 'w')",
        "subprocess.run(argv)",
        "subprocess.run(argv, text=True, encoding='utf-8')",
    ],
)
def test_bytes_and_named_encodings_are_good(line: str) -> None:
    assert list(check_text(Path("a.py"), line)) == []


@needs_git
def test_what_users_run_names_its_encodings() -> None:
    assert check_encodings(checkout_root()) == []
