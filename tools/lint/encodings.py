"""Text of users' files is UTF-8 on every system: on Windows Python takes another encoding unless one is named."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from lint.problem import Problem, source_files

FOLDERS = ("cli/", "emulators/wificnc_chips/")
PROCESSES = ("run", "Popen", "check_output")
NO_FILES = ("os", "tarfile", "zipfile")  # modules whose open() opens something else
POSITIONS = {"read_text": 0, "write_text": 1}  # where the encoding is, by position


def check_encodings(root: Path) -> list[Problem]:
    """All Python files that users run."""
    paths = [path for path in source_files(root, ".py") if path.as_posix().startswith(FOLDERS)]
    return [problem for path in paths for problem in check_text(path, (root / path).read_text(encoding="utf-8"))]


def check_text(path: Path, text: str) -> Iterator[Problem]:
    """One file."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and _is_text(node) and not _has_encoding(node):
            yield Problem(path, node.lineno, f'{_name(node)}() of text: name its encoding, like encoding="utf-8"')


def _name(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _keyword(call: ast.Call, name: str) -> ast.expr | None:
    return next((keyword.value for keyword in call.keywords if keyword.arg == name), None)


def _is_text(call: ast.Call) -> bool:
    name = _name(call)
    if name in PROCESSES:
        return _keyword(call, "text") is not None
    return name in POSITIONS or (name == "open" and _opens_text(call))


def _opens_text(call: ast.Call) -> bool:
    """open() and Path.open(), without a b in the mode."""
    is_method = isinstance(call.func, ast.Attribute)
    if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) in NO_FILES:
        return False
    place = 0 if is_method else 1
    mode = _keyword(call, "mode") or (call.args[place] if len(call.args) > place else None)
    if mode is None:
        return not is_method or not call.args
    return isinstance(mode, ast.Constant) and isinstance(mode.value, str) and "b" not in mode.value


def _has_encoding(call: ast.Call) -> bool:
    place = POSITIONS.get(_name(call), len(call.args))
    return _keyword(call, "encoding") is not None or len(call.args) > place
