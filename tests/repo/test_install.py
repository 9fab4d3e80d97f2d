"""How to get the command: one page has it, its lines come from one table, and no other page has another line."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from generate.board_start import index_text
from generate.install import PAGE, README, install_lines, readme_text
from tools_here import needs_git
from wificnc.build.checkout import checkout_root

ROOT = checkout_root()
INSTALL = re.compile(r"(?:pip|pipx|uv|-m pip)\s+(?:install|tool install)[^`\n]*\bwificnc\b[^`\n]*")
CHIPS = "wificnc[chips]"
BUILD_TOOLS = ("pyproject.toml", "CHANGELOG.md", "tests/", ".github/", ".ci/", "tools/generate/install.py")


def lines_of(text: str) -> list[str]:
    """Commands that install the command; an editable checkout is none, and CHIPS is for who has it."""
    return [found.strip() for found in INSTALL.findall(text) if " -e " not in found and CHIPS not in found]


@needs_git
def test_no_other_page_has_an_install_line() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    found = []
    for name in listed:
        path = ROOT / name
        if (
            name in (PAGE, README)
            or name.startswith(BUILD_TOOLS)
            or path.suffix not in (".md", ".py", ".j2", ".html", ".ts")
        ):
            continue
        found += [f"{name}: {line}" for line in lines_of(path.read_text(encoding="utf-8"))]
    assert found == []


@pytest.mark.parametrize("line", ["pip install wificnc", "pip install 'wificnc[esp]'", "pipx install wificnc",
                                  "py -m pip install wificnc", "pip install --upgrade wificnc"])  # fmt: skip
def test_such_a_line_is_found(line: str) -> None:
    assert lines_of(f"text\n{line}   # and\n")


def test_the_page_has_the_lines_of_each_system() -> None:
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    for system, line in install_lines().items():
        section = text.partition(f"\n### {system}\n")[2].partition("\n### ")[0]
        assert f"\n{line}\n" in section, system


def test_the_readme_has_the_lines_of_the_table_and_no_others() -> None:
    text = (ROOT / README).read_text(encoding="utf-8")
    assert readme_text() in text
    assert set(lines_of(text.replace(readme_text(), ""))) == set()


def test_pages_of_boards_link_to_it() -> None:
    for path in [*(ROOT / "docs/start").glob("*.md"), ROOT / "docs/esp32.md"]:
        assert path.name == Path(PAGE).name or "README.md#install-wificnc" in path.read_text(encoding="utf-8"), path


def test_the_index_replaces_the_file_on_all_systems() -> None:
    files, index = install_lines(False), install_lines(True)
    assert files.keys() == index.keys() and not any(".whl" in line for line in index.values())
    assert all(".whl" in line for line in files.values())
    assert "wificnc" in index_text()
