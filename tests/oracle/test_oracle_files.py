"""Whole files that CAM programs wrote: LinuxCNC goes the same way.

WIFICNC_ORACLE_FILES names a folder with more of them.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from gcode_core import ROOT

FOLDERS = [ROOT / "examples", *map(Path, filter(None, [os.environ.get("WIFICNC_ORACLE_FILES")]))]
FILES = [path for folder in FOLDERS for path in sorted(folder.glob("*.nc"))]
MOVES_MIN = 100


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_file(agree: Callable[[str], int], path: Path) -> None:
    program = path.read_text(encoding="utf-8", errors="replace")
    assert agree(program + "\nM2\n") > MOVES_MIN
