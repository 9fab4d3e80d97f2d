"""The lint of the virtual chips' interface."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from lint.chips import MODULES, check_chips, check_file, listed
from tools_here import needs_git
from wificnc.build.checkout import checkout_root

ROOT = checkout_root()
NAMES = {MODULES[0]: {"wire"}, MODULES[1]: {"Chip"}, MODULES[2]: set()}
TEST = Path("tests/a/test_a.py")


def found(text: str, path: Path = TEST) -> list[str]:
    return [problem.message for problem in check_file(path, ast.parse(text), NAMES)]


@pytest.mark.parametrize(
    "text",
    [
        "import wificnc_chips",
        "from wificnc_chips import wire",
        "from wificnc_chips import esp32",
        "from wificnc_chips.esp32 import Chip",
        "from wificnc_chips_of_others import other",
    ],
)
def test_the_interface_may_be_used(text: str) -> None:
    assert found(text) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import wificnc_chips.job", "wificnc_chips.job is private"),
        ("from wificnc_chips.job import run_on_chip", "wificnc_chips.job is private"),
        ("def f():\n    from wificnc_chips.esp32.chip import Chip", "wificnc_chips.esp32.chip is private"),
        ("from wificnc_chips import job", "wificnc_chips.job is not in its __all__"),
        ("from wificnc_chips.esp32 import Cpu", "wificnc_chips.esp32.Cpu is not in its __all__"),
    ],
)
def test_what_is_private_is_refused(text: str, said: str) -> None:
    (problem,) = found(text)
    assert problem.startswith(said)


def test_the_command_imports_it_in_functions_alone() -> None:
    inside, outside = "def f():\n    import wificnc_chips\n", "import wificnc_chips\n"
    command = Path("cli/wificnc/a.py")
    assert found(inside, command) == [] and found(outside) == []
    assert found(outside, command) == ["wificnc_chips may not be installed: import it in a function"]
    typed = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from wificnc_chips import wire\n"
    assert found(typed, command) == []


@needs_git  # it tells which files are ours
def test_each_module_lists_its_names_and_this_tree_keeps_to_them() -> None:
    for module in MODULES:
        assert listed(ROOT / "emulators" / module.replace(".", "/") / "__init__.py"), module
    assert check_chips(ROOT) == []
