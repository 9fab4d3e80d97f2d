"""Every line of the checklist has a test, and the test quotes it."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib
from wificnc.connection.words import ALARMS

TESTS = Path(__file__).parents[1]


def lines() -> Iterator[tuple[str, list[str]]]:
    """(quoted line, its tests), from checklist.toml."""
    table = tomllib.loads((TESTS / "grbl" / "checklist.toml").read_text(encoding="utf-8"))
    for section in table["section"]:
        for quote, *tests in section["lines"]:
            yield quote, tests


def plain(text: str) -> str:
    """Without marks, line ends and case, so that a quote may be wrapped and its code marked."""
    return re.sub(r"\s+", " ", re.sub(r"\\+[rn]|[`*\\]", "", text)).lower()


@cache
def sources(path: Path) -> dict[str, str]:
    """What each test of a file says: its own text, and the tables of the file that it may be fed from."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    tables = " ".join(ast.unparse(node) for node in tree.body if isinstance(node, ast.Assign))
    own = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    return {
        name: plain(" ".join([ast.get_docstring(node) or "", *map(ast.unparse, node.decorator_list), tables]))
        for name, node in own.items()
        if name.startswith("test_")
    }


def problem(quote: str, tests: list[str]) -> str | None:
    """Why the tests do not prove the line."""
    said = []
    for test in tests:
        file, _, name = test.partition("::")
        path = TESTS / file
        if not path.is_file() or name not in sources(path):
            return f"there is no test {test}"
        said.append(sources(path)[name])
    if not tests:
        return "no test"
    return None if any(plain(quote) in text for text in said) else "no test quotes it"


@pytest.mark.parametrize(("quote", "tests"), list(lines()), ids=lambda value: value if isinstance(value, str) else "")
def test_line_has_a_test_that_quotes_it(quote: str, tests: list[str]) -> None:
    assert problem(quote, tests) is None


def test_no_line_stands_twice() -> None:
    quotes = [quote for quote, _ in lines()]
    assert len(quotes) == len(set(quotes)) > 150


@pytest.mark.parametrize(
    ("tests", "reason"),
    [
        ([], "no test"),
        (["grbl/test_lines.py::test_nothing"], "there is no test"),
        (["grbl/test_missing.py::test_order_of_checks"], "there is no test"),
        (["grbl/test_lines.py::test_order_of_checks"], "no test quotes it"),
    ],
)
def test_a_line_without_proof_is_found(tests: list[str], reason: str) -> None:
    found = problem("the machine sings while it homes", tests)
    assert found is not None and found.startswith(reason)


def deviations() -> dict[str, list[str]]:
    table = tomllib.loads((TESTS / "grbl" / "checklist.toml").read_text(encoding="utf-8"))
    return dict(table["deviations"])


def test_every_deviation_has_tests_that_are_there() -> None:
    for what, tests in deviations().items():
        assert tests, what
        for test in tests:
            file, _, name = test.partition("::")
            assert name in sources(TESTS / file), f"{what}: {test}"


def test_the_page_lists_the_deviations_that_are_tested() -> None:
    page = (TESTS.parent / "docs" / "grbl-compatibility.md").read_text(encoding="utf-8")
    section = page.split("## Different on purpose")[1].split("\n## ")[0]
    rows = [line.split("|")[1:-1] for line in section.splitlines() if line.startswith("| ")][1:]
    assert [row[0].strip() for row in rows] == list(deviations())
    assert all(len(row) == 4 and all(cell.strip() for cell in row) for row in rows)


def test_the_page_names_every_alarm() -> None:
    page = (TESTS.parent / "docs" / "grbl-compatibility.md").read_text(encoding="utf-8")
    listed = re.findall(r"(?:^|· )(\d+) ", page.split("## Alarms")[1].split("After 1,")[0].replace("\n", " ").strip())
    assert listed == [str(number) for number in ALARMS]
