"""The virtual chip without an image."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from wificnc.build.mzsim import ensure_mzsim_library
from wificnc.chip.virtual import VirtualChip, load_mzsim

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def library() -> ctypes.CDLL:
    return load_mzsim(ensure_mzsim_library())


@pytest.fixture
def chip(library: ctypes.CDLL) -> Iterator[VirtualChip]:
    with VirtualChip(library) as chip:
        yield chip
