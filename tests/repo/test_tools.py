"""The ready-made tools behind `make lint`: each, as we call it, catches a violation and passes a clean file."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from lint import external
from lint.__main__ import LINTS, main
from lint.problem import Problem
from wificnc.build.host import FOLDERS

ROOT = Path(__file__).resolve().parents[2]
HEAD = "/* SPDX-License-Identifier: MIT */\n"

GOOD_C = HEAD + "int f(int a);\nint f(int a) {\n    return a + 1;\n}\n"
GOOD_PYTHON = '"""Doc."""\n\n\ndef f(a: int) -> int:\n    """Doc."""\n    return a + 1\n'

# lint, file, clean text, text with a violation, a word of what the tool then says
CASES: list[tuple[Callable[[Path], list[Problem]], str, str, str, str]] = [
    (external.check_ruff, "cli/wificnc/a.py", GOOD_PYTHON, "import os\n", "F401"),
    (external.check_ruff_format, "cli/wificnc/a.py", GOOD_PYTHON, "x = [1,2]\n", "a.py"),
    (
        external.check_mypy,
        "cli/wificnc/a.py",
        GOOD_PYTHON,
        # Not "str": mypy's cache takes a file of equal size and second for the one that it knows.
        GOOD_PYTHON.replace("-> int", "-> bytes"),
        "return value type",
    ),
    (external.check_clang_format, "core/a.c", GOOD_C, GOOD_C.replace("{\n", "\n{\n"), "not formatted"),
    (external.check_cppcheck, "core/a.c", GOOD_C, GOOD_C.replace("return a", "int b[2]; b[2] = a; return a"), "rray"),
    (external.check_compilers, "core/a.c", GOOD_C, GOOD_C.replace("return a", "short s = a; return s"), "onversion"),
]


PACKAGES = (
    "cli/wificnc",
    "tools/lint",
    "tools/bench",
    "tools/motion",
    "tools/xtensa",
    "tools/mips",
    "emulators/wificnc_chips",
    "emulators/xtensa_programs",
    "tools/pages",
    "tools/sizes",
    "tools/suite",
    "tools/generate",
    "tools/web",
)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """An empty checkout with our configuration."""
    for name in (*PACKAGES, *FOLDERS):
        (tmp_path / name).mkdir(parents=True)
    for name in ("pyproject.toml", ".clang-format"):
        shutil.copy(ROOT / name, tmp_path / name)
    for package in PACKAGES:
        (tmp_path / package / "__init__.py").write_text('"""Doc."""\n')
    for module in ("tools/dev.py", "emulators/hatch_build.py"):
        (tmp_path / module).write_text('"""Doc."""\n')
    return tmp_path


@pytest.mark.parametrize(("lint", "name", "good", "bad", "word"), CASES, ids=[case[0].__name__ for case in CASES])
def test_tool_catches_a_violation(
    tree: Path, lint: Callable[[Path], list[Problem]], name: str, good: str, bad: str, word: str
) -> None:
    if lint is external.check_compilers and not (shutil.which("gcc") or shutil.which("clang")):
        pytest.skip("neither gcc nor clang is on this machine")
    (tree / name).write_text(good)
    assert lint(tree) == []
    (tree / name).write_text(bad)
    assert any(word in str(problem) for problem in lint(tree))


@pytest.mark.slow
def test_generated_lint_finds_a_stale_file(tmp_path: Path) -> None:
    """The real generators in a copy of the tree, in which one output was edited by hand."""
    for folder in ("boards", "cli", "core", "docs", "emulators", "linuxcnc", "protocol", "targets", "tools"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__", "*.png"))
    for name in ("README.md", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    stale = tmp_path / "core/settings/settings_gen.h"
    stale.write_text(stale.read_text() + "/* by hand */\n")
    assert external.check_generated(ROOT) == []
    assert [problem.message.split()[0] for problem in external.check_generated(tmp_path)] == [
        "core/settings/settings_gen.h"
    ]


def test_missing_tool_is_a_problem(tmp_path: Path) -> None:
    (problem,) = external.run_tool(tmp_path, ["no-such-tool-anywhere"])
    assert "not installed" in problem.message


def test_unknown_lint_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["includes", "nonsense"]) == 2
    assert "no such lint: nonsense" in capsys.readouterr().err


def test_found_problem_fails_the_run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    broken = Problem(Path("a.c"), 3, "broken")
    monkeypatch.setitem(LINTS, "x", ("a rule", lambda root: [broken]))
    assert main(["x"]) == 1
    out = capsys.readouterr().out
    assert "1 problem" in out and "a.c:3: broken" in out
    assert main(["includes"]) == 0
