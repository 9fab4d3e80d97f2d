"""The interface for Python: what it lists is there, typed and described, and the README's example runs."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from types import ModuleType

import pytest
import wificnc
import wificnc_chips
from wificnc.build.mips import find_compiler
from wificnc.errors import BuildError
from wificnc_chips import esp32, pic32mz

MODULES = [wificnc_chips, esp32, pic32mz]
README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
TABLE = README.partition("## Interface for Python\n")[2].partition("```")[0]
EXAMPLE = README.partition("```python\n")[2].partition("```")[0]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_each_name_is_there_and_described(module: ModuleType) -> None:
    assert len(set(module.__all__)) == len(module.__all__)
    for name in module.__all__:
        value = getattr(module, name)
        if inspect.isfunction(value):
            typed = inspect.signature(value)
            assert typed.return_annotation is not inspect.Signature.empty, name
            assert all(one.annotation is not one.empty for one in typed.parameters.values()), name
        if inspect.isfunction(value) or inspect.isclass(value):
            assert value.__doc__, name


def test_the_readme_names_nothing_else() -> None:
    listed = {name for module in MODULES for name in module.__all__}
    rows = [row.split("|")[2] for row in TABLE.splitlines() if row.startswith("| `wificnc_chips")]
    named = {name for row in rows for name in re.findall(r"`(\w+)", row)}
    assert len(rows) == len(MODULES) and named <= listed


def test_both_packages_have_one_version() -> None:
    assert wificnc_chips.__version__ == wificnc.__version__


def test_the_example_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    try:
        find_compiler("gcc")
    except BuildError as err:
        pytest.skip(f"{err.message}: {err.hint}")
    exec(compile(EXAMPLE, "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert "Grbl 1.1h" in said
    steps, seconds = re.findall(r"^(\d+) steps after ([\d.]+) s$", said, re.MULTILINE)[0]
    assert int(steps) == 250 and float(seconds) > 2.0  # $100 is 250 steps/mm
