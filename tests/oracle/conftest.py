"""LinuxCNC's interpreter next to ours. Skipped where it is not installed: Debian, Ubuntu: linuxcnc-uspace."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Callable

import pytest
from canon import rs274
from compare import check_same
from gcode_core import XYZABC
from gcode_library import gcode_library
from ours import Ours, filtered


@pytest.fixture(scope="session")
def lib() -> ctypes.CDLL:
    """core/gcode and its neighbours."""
    if shutil.which("rs274") is None:
        pytest.skip("there is no rs274 here (Debian, Ubuntu: apt-get install linuxcnc-uspace)")
    return gcode_library()


@pytest.fixture(scope="session")
def agree(lib: ctypes.CDLL, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], int]:
    """Give a program to both and compare. @return how many calls it is"""
    folder = tmp_path_factory.mktemp("rs274")

    def compare(program: str) -> int:
        ours = Ours(lib, XYZABC)
        for line in filtered(lib, program):
            ours.run(line)
        check_same(ours.calls, rs274(program, folder))
        return len(ours.calls)

    return compare
