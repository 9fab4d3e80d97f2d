"""The virtual chips (emulators/) are used by their interface: three modules, and of those what `__all__` lists.

The command imports them only inside of functions: it works without that package.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from lint.problem import Problem, source_files

PACKAGE = "wificnc_chips"
HOME = Path("emulators")
MODULES = (PACKAGE, f"{PACKAGE}.esp32", f"{PACKAGE}.pic32mz")


def check_chips(root: Path) -> list[Problem]:
    """Imports in Python outside of emulators/, against the interface."""
    names = {module: listed(root / HOME / module.replace(".", "/") / "__init__.py") for module in MODULES}
    problems: list[Problem] = []
    for path in source_files(root, ".py"):
        text = (root / path).read_text(encoding="utf-8")
        if HOME not in path.parents and PACKAGE in text:
            problems += check_file(path, ast.parse(text), names)
    return problems


def listed(file: Path) -> set[str]:
    """`__all__` of a module; nothing where there is no such file."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body if file.is_file() else ():
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def check_file(path: Path, tree: ast.Module, names: dict[str, set[str]]) -> Iterator[Problem]:
    """The imports of one file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and _is_ours(node.module or ""):
            yield from _check_names(path, node, names)
        elif isinstance(node, ast.Import):
            for name in node.names:
                if _is_ours(name.name) and name.name not in MODULES:
                    yield Problem(path, node.lineno, f"{name.name} is private: use {', '.join(MODULES)}")
    if path.parts[0] == "cli":
        for node in tree.body:
            if isinstance(node, (ast.Import, ast.ImportFrom)) and PACKAGE in ast.unparse(node):
                yield Problem(path, node.lineno, f"{PACKAGE} may not be installed: import it in a function")


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] == PACKAGE


def _check_names(path: Path, node: ast.ImportFrom, names: dict[str, set[str]]) -> Iterator[Problem]:
    module = node.module or ""
    if module not in MODULES:
        yield Problem(path, node.lineno, f"{module} is private: use {', '.join(MODULES)}")
        return
    for name in node.names:
        if name.name not in names[module] and f"{module}.{name.name}" not in MODULES:
            yield Problem(path, node.lineno, f"{module}.{name.name} is not in its __all__")
