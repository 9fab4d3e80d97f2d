"""The lint that finds names in headers which no other file uses."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.callers import check_callers

HEADER = "core/step/prep.h"
SOURCE = "core/step/prep.c"


def write(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def found(root: Path) -> list[str]:
    return [f"{problem.line} {problem.message.split()[0]}" for problem in check_callers(root)]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A header with a function and a table, and the file that defines both and uses them itself."""
    write(
        tmp_path, HEADER, "/* Spans. */\n\n/** A span. */\nint prep_one(int a,\n    int b);\nextern const int rows[];\n"
    )
    write(
        tmp_path, SOURCE, "const int rows[] = {1};\nint prep_one(int a, int b) {\n    return rows[prep_one(a, b)];\n}\n"
    )
    return tmp_path


def test_a_name_without_user_is_found(tree: Path) -> None:
    assert found(tree) == ["4 prep_one", "6 rows"]


@pytest.mark.parametrize("text", ["/* prep_one() and rows */", 'char *say = "prep_one rows";', "// prep_one, rows"])
def test_comments_and_strings_do_not_use(tree: Path, text: str) -> None:
    write(tree, "core/motion/emit.c", text + "\n")
    assert found(tree) == ["4 prep_one", "6 rows"]


@pytest.mark.parametrize("name", ["core/motion/emit.c", "targets/esp32/vector.S", "linuxcnc/link.h"])
def test_another_file_is_a_user(tree: Path, name: str) -> None:
    write(tree, name, "call prep_one, rows\n")
    assert found(tree) == []


@pytest.mark.parametrize(
    "name", ["core/hal/contract.c", "tests/motion/emit.c", "targets/esp32/test/emit.c", "cli/a.py"]
)
def test_checks_tests_and_python_are_no_users_of_the_core(tree: Path, name: str) -> None:
    write(tree, name, "prep_one(rows)\n")
    assert found(tree) == ["4 prep_one", "6 rows"]


def test_a_function_that_each_target_defines_needs_a_user_too(tree: Path) -> None:
    write(tree, "targets/pc/prep.c", "int prep_one(int a, int b) {\n    return a;\n}\n")
    assert "4 prep_one" in found(tree)


def test_an_inline_function_of_the_header_is_a_user(tree: Path) -> None:
    inline = "static inline int both(void) {\n    return prep_one(rows[0], 1);\n}\n"
    write(tree, HEADER, (tree / HEADER).read_text() + inline)
    assert found(tree) == []


@pytest.mark.parametrize("user", ["cli/wificnc/simulator/library.py", "web/wasm/preflight.c"])
def test_the_library_is_called_by_python_and_the_page(tree: Path, user: str) -> None:
    (tree / HEADER).rename(tree / "core/step/other.txt")
    write(tree, "targets/sim/sim.h", "/* A job. */\n\nint sim_run(void);\n")
    assert found(tree) == ["3 sim_run"]
    write(tree, user, "sim_run()\n")
    assert found(tree) == []


def test_what_is_for_tests_says_so(tree: Path) -> None:
    text = (tree / HEADER).read_text()
    write(tree, HEADER, text.replace("/** A span", "/** [tests] A span"))
    assert found(tree) == ["6 rows"]
    write(tree, HEADER, text.replace("/* Spans", "/* [tests] Spans"))
    assert found(tree) == []
