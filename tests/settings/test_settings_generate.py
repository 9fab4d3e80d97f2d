"""The generator: fresh in the repository, the same bytes every time, and it says what is stale."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from generate import settings
from generate.__main__ import run
from settings_core import ROOT

CLANG_FORMAT = Path(sys.executable).with_name("clang-format")
SOURCES = (settings.SOURCE, settings.STATUS_HEADER)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of what the generator reads and writes."""
    for path in (*SOURCES, *settings.OUTPUTS):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    return tmp_path


def edit(tree: Path, old: str, new: str, path: str = settings.SOURCE) -> None:
    text = (tree / path).read_text(encoding="utf-8")
    assert old in text
    (tree / path).write_text(text.replace(old, new), encoding="utf-8")


def test_what_is_committed_is_fresh() -> None:
    """All of them, not only those of the settings."""
    argv = [sys.executable, "-m", "generate", "--check"]
    done = subprocess.run(argv, cwd=ROOT / "tools", capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_fresh_tree_is_not_touched(tree: Path) -> None:
    before = {path: (tree / path).stat().st_mtime_ns for path in settings.OUTPUTS}
    assert run([settings.texts], tree) == 0
    assert {path: (tree / path).stat().st_mtime_ns for path in settings.OUTPUTS} == before


@pytest.mark.parametrize("path", settings.OUTPUTS)
def test_check_names_the_stale_file_and_leaves_it(tree: Path, path: str, capsys: pytest.CaptureFixture[str]) -> None:
    (tree / path).write_text("by hand\n", encoding="utf-8")
    assert run([settings.texts], tree, check=True) == 1
    assert capsys.readouterr().err == f"{path} is stale: run `make generate`\n"
    assert (tree / path).read_text(encoding="utf-8") == "by hand\n"


@pytest.mark.parametrize("path", settings.OUTPUTS)
def test_a_missing_file_is_stale_and_written(tree: Path, path: str) -> None:
    (tree / path).unlink()
    assert run([settings.texts], tree, check=True) == 1
    assert run([settings.texts], tree) == 0
    assert (tree / path).read_bytes() == (ROOT / path).read_bytes()


def test_a_changed_default_changes_only_the_files_that_show_it(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    edit(tree, "default = 500.0", "default = 600.0")
    assert run([settings.texts], tree, check=True) == 1
    shown = ("core/settings/settings_table.c", "docs/settings.md")
    assert [line.split()[0] for line in capsys.readouterr().err.splitlines()] == list(shown)
    assert run([settings.texts], tree) == 0
    assert run([settings.texts], tree, check=True) == 0
    assert "600" in (tree / "core/settings/settings_table.c").read_text(encoding="utf-8")
    assert "600.000" in (tree / "docs/settings.md").read_text(encoding="utf-8")


def test_an_answer_that_grbl_does_not_have_is_refused(tree: Path) -> None:
    edit(tree, 'below = "STEP_PULSE_SHORT"', 'below = "STEP_PULSE_TOO_SHORT"')
    with pytest.raises(ValueError, match=r"\$0 step_pulse_us: core/gcode/status.h has no STEP_PULSE_TOO_SHORT"):
        run([settings.texts], tree)


@pytest.mark.parametrize("path", settings.OUTPUTS)
def test_nothing_of_the_place_and_time_is_in_the_text(path: str) -> None:
    text = (ROOT / path).read_text(encoding="utf-8")
    assert settings.SOURCE in text
    assert str(ROOT) not in text
    assert not re.search(r"\b20\d\d-\d\d|\d\d:\d\d", text)


@pytest.mark.skipif(not CLANG_FORMAT.exists(), reason="clang-format is not installed")
@pytest.mark.parametrize("path", [path for path in settings.OUTPUTS if path.startswith("core/")])
def test_generated_c_is_formatted_as_our_own(path: str) -> None:
    done = subprocess.run([CLANG_FORMAT, "--dry-run", "-Werror", path], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
