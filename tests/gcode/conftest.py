"""What the tests of G-code share."""

from __future__ import annotations

import ctypes

import pytest
from gcode_core import Controller
from gcode_library import gcode_library
from hypothesis import settings

# A busy machine is no failure: speed is measured by make bench.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


@pytest.fixture(scope="session")
def lib() -> ctypes.CDLL:
    """core/gcode and its neighbours."""
    return gcode_library()


@pytest.fixture
def cnc(lib: ctypes.CDLL) -> Controller:
    """Three axes, all at 0, default modes."""
    return Controller(lib)
