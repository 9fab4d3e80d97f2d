"""What the tests of G-code share."""

from __future__ import annotations

import ctypes

import pytest
from gcode_core import Controller
from gcode_library import gcode_library


@pytest.fixture(scope="session")
def lib() -> ctypes.CDLL:
    """core/gcode and its neighbours."""
    return gcode_library()


@pytest.fixture
def cnc(lib: ctypes.CDLL) -> Controller:
    """Three axes, all at 0, default modes."""
    return Controller(lib)
