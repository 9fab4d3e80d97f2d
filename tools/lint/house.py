"""House rules that no ready-made tool knows: sizes, file heads, leftovers, and paths of somebody's machine."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from lint.problem import Problem, source_files, tracked_files

MAX_FILE_LINES = 600
MAX_C_FUNCTION_LINES = 60
MAX_PYTHON_FUNCTION_LINES = 40

CODE = (".c", ".h", ".def", ".py")
TEXT = (*CODE, ".md", ".toml", ".nc", ".ini", ".sh", ".json", ".svg", ".yml", ".j2", "")

SPDX = "/* SPDX-License-Identifier: MIT"
# Written in two halves so that this file does not find itself.
NOTE_TO_SELF = re.compile(r"\b(TO" r"DO|FIX" r"ME)\b(?!\(#\d+\))")
DISABLED = re.compile(r"^\s*#\s*if" r"\s+0\b")
MACHINE_PATH = re.compile(r"(?<![\w./~$}-])/(?:work|root|home|Users|tmp)" r"/\w")
FUNCTION_HEAD = re.compile(r"^[A-Za-z_][\w\s*()]*\(")


def check_house(root: Path) -> list[Problem]:
    """All house rules over all tracked text."""
    problems: list[Problem] = []
    for path in source_files(root, *CODE):
        problems += check_code(path, (root / path).read_text())
    for path in tracked_files(root):
        if path.suffix in TEXT and (lines := _text_lines(root / path)):
            problems += _matches(path, lines, MACHINE_PATH, "a path of one machine: make it relative or a parameter")
    return sorted(set(problems))


def check_code(path: Path, text: str) -> list[Problem]:
    """The rules for one C or Python file."""
    lines = text.splitlines()
    problems = []
    if len(lines) > MAX_FILE_LINES:
        problems.append(Problem(path, len(lines), f"{len(lines)} lines; a file has at most {MAX_FILE_LINES}"))
    problems += _matches(path, lines, NOTE_TO_SELF, "a note to self needs its issue: (#12) right after it")
    if path.suffix == ".py":
        return [*problems, *_long_functions(path, _python_functions(text), MAX_PYTHON_FUNCTION_LINES)]
    problems += _matches(path, lines, DISABLED, "disabled code: delete it, git remembers")
    problems += _long_functions(path, _c_functions(lines), MAX_C_FUNCTION_LINES)
    if path.parts[0] in ("core", "targets", "linuxcnc"):
        problems += _check_head(path, lines)
    return problems


def _check_head(path: Path, lines: list[str]) -> Iterator[Problem]:
    if not lines or not lines[0].startswith(SPDX):
        yield Problem(path, 1, f"the first line is not `{SPDX} ...`")
    elif path.suffix == ".h" and not (len(lines) > 1 and re.match(r" \* \S", lines[1])):
        yield Problem(path, 2, "a header begins by saying what it is for")


def _text_lines(path: Path) -> list[str]:
    try:
        return path.read_text().splitlines()
    except UnicodeDecodeError:
        return []


def _matches(path: Path, lines: list[str], pattern: re.Pattern[str], message: str) -> Iterator[Problem]:
    for number, line in enumerate(lines, 1):
        if pattern.search(line):
            yield Problem(path, number, message)


def _long_functions(path: Path, functions: Iterator[tuple[str, int, int]], limit: int) -> Iterator[Problem]:
    for name, line, length in functions:
        if length > limit:
            yield Problem(path, line, f"{name} has {length} lines; a function has at most {limit}")


def _python_functions(text: str) -> Iterator[tuple[str, int, int]]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield f"{node.name}()", node.lineno, (node.end_lineno or node.lineno) - node.lineno + 1


def _c_functions(lines: list[str]) -> Iterator[tuple[str, int, int]]:
    """Functions as clang-format leaves them: a head in the first column, perhaps continued on indented lines, that
    ends in `) {`; then a body that ends in a `}` of the first column."""
    head = 0
    is_open = False
    for number, line in enumerate(lines, 1):
        if is_open and line.startswith("}"):
            yield f"{_function_name(lines[head - 1])}()", head, number - head + 1
            is_open = False
        elif not is_open and FUNCTION_HEAD.match(line):
            head = number
        is_open = is_open or (line.endswith(") {") and _is_head(lines[head - 1 : number]))


def _is_head(lines: list[str]) -> bool:
    """Whether these lines are one function head: nothing between its first column and its `{` ends a statement."""
    return bool(FUNCTION_HEAD.match(lines[0])) and not re.search(r"[;{}]", "".join(lines)[:-1])


def _function_name(head: str) -> str:
    match = re.search(r"(\w+)\s*\(", head)
    return match[1] if match else "?"
