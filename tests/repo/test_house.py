"""The house rules: each with a text that keeps it and one that breaks it."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.house import MAX_C_FUNCTION_LINES, MAX_FILE_LINES, MAX_PYTHON_FUNCTION_LINES, check_code, check_house

ROOT = Path(__file__).resolve().parents[2]
HEAD = "/* SPDX-License-Identifier: MIT\n * What this is for. */\n"


def messages(name: str, text: str) -> list[str]:
    return [problem.message for problem in check_code(Path(name), text)]


def c_function(lines: int, head: str = "static int f(int a) {") -> str:
    body = "    a++;\n" * (lines - 1 - len(head.splitlines()))
    return HEAD + head + "\n" + body + "}\n"


@pytest.mark.parametrize(
    "head", ["int f(int a) {", "static int f(int a,\n             int b) {", "struct s *f(void) {"]
)
def test_c_function_length(head: str) -> None:
    assert messages("core/base/a.c", c_function(MAX_C_FUNCTION_LINES, head)) == []
    (found,) = messages("core/base/a.c", c_function(MAX_C_FUNCTION_LINES + 1, head))
    assert found == f"f() has {MAX_C_FUNCTION_LINES + 1} lines; a function has at most {MAX_C_FUNCTION_LINES}"


def test_long_table_is_no_function() -> None:
    assert messages("core/base/a.c", HEAD + "static const int t[] = {\n" + "    1,\n" * 100 + "};\n") == []


def test_python_function_length() -> None:
    text = "def f() -> None:\n" + "    print()\n" * (MAX_PYTHON_FUNCTION_LINES - 1)
    assert messages("cli/a.py", text) == []
    assert "f() has" in messages("cli/a.py", text + "    print()\n")[0]


def test_file_length() -> None:
    text = HEAD + "int a;\n" * (MAX_FILE_LINES - 2)
    assert messages("core/base/a.h", text) == []
    assert "a file has at most" in messages("core/base/a.h", text + "int b;\n")[0]


@pytest.mark.parametrize("word", ["TO" + "DO", "FIX" + "ME"])
def test_note_to_self_needs_an_issue(word: str) -> None:
    assert messages("core/base/a.c", f"{HEAD}/* {word}(#12): better */\n") == []
    assert "needs its issue" in messages("core/base/a.c", f"{HEAD}/* {word}: better */\n")[0]


def test_disabled_code() -> None:
    assert "disabled code" in messages("core/base/a.c", HEAD + "#if" + " 0\nint a;\n#endif\n")[0]


def test_licence_line() -> None:
    assert "SPDX" in messages("core/base/a.c", "int a;\n")[0]
    assert messages("core/base/a.c", "/* SPDX-License-Identifier: MIT */\nint a;\n") == []


def test_header_says_what_it_is_for() -> None:
    assert "what it is for" in messages("core/base/a.h", "/* SPDX-License-Identifier: MIT */\nint a;\n")[0]
    assert messages("core/base/a.h", HEAD) == []


@pytest.mark.parametrize("folder", ["work", "root", "home", "tmp"])
def test_path_of_one_machine(tmp_path: Path, folder: str) -> None:
    (tmp_path / "a.md").write_text(f"first\nsee /{folder}" + "/me/file\n")
    (problem,) = check_house(tmp_path)
    assert (problem.line, "path of one machine" in problem.message) == (2, True)


def test_relative_path_is_nobodys(tmp_path: Path) -> None:
    (tmp_path / "a.md").write_text("see docs/work" + "/me and ./tmp" + "/x and the root/part\n")
    assert check_house(tmp_path) == []


def test_our_tree_keeps_the_rules() -> None:
    assert check_house(ROOT) == []
