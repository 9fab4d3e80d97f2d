"""A command starts without what only other uses of it need: each takes a tenth of a second to load, or more."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("wificnc_chips", "jinja2", "numpy", "matplotlib")  # the virtual chip, headers of firmware, pictures
SHOW = "import importlib, sys; importlib.import_module(sys.argv[1]); print(*sys.modules)"


@pytest.mark.parametrize("command", ["serve", "sim"])
def test_it_loads_nothing_heavy(command: str) -> None:
    run = [sys.executable, "-c", SHOW, f"wificnc.commands.{command}"]
    loaded = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    assert f"wificnc.commands.{command}" in loaded
    assert [name for name in loaded if name.startswith(HEAVY)] == []
