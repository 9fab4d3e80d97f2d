"""What chip_differences.toml names is there, and has a reason."""

from __future__ import annotations

import ast
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from chip_declared import always, declared, difference

HERE = Path(__file__).parent


@cache
def names_with_a_controller() -> frozenset[str]:
    """file::test of every test here that takes `grbl`, or a fixture of its file that does."""
    found = set()
    for path in HERE.glob("test_*.py"):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        functions = [node for node in body if isinstance(node, ast.FunctionDef)]
        taken = {node.name: {argument.arg for argument in node.args.args} for node in functions}
        makers = {"grbl"} | {name for name, arguments in taken.items() if "grbl" in arguments}
        found |= {f"{path.name}::{name}" for name, arguments in taken.items() if arguments & makers}
    return frozenset(found)


def test_what_runs_at_any_time_is_there() -> None:
    assert always() <= names_with_a_controller() and len(always()) > 30


def test_every_difference_is_of_tests_that_are_there() -> None:
    for row in declared()["difference"]:
        assert len(row["reason"]) > 20
        for pattern in row["tests"]:
            function = pattern.split("[")[0]
            assert any(fnmatchcase(name, function) for name in names_with_a_controller()), pattern


def test_a_difference_is_found_by_its_parameters() -> None:
    assert difference("test_answers.py::test_errors_of_dollar_lines[chip-$J=A1F100-error:20]")
    assert difference("test_answers.py::test_errors_of_dollar_lines[chip-$J-error:3]") is None
    assert (
        difference("test_switches.py::test_door_in_a_jog[chip]") and difference("test_switches.py::test_estop") is None
    )
