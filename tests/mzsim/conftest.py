"""The virtual chip without an image."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator

import pytest
from wificnc.build.mzsim import ensure_mzsim_library
from wificnc.chip.virtual import VirtualChip, load_mzsim


@pytest.fixture(scope="session")
def library() -> ctypes.CDLL:
    return load_mzsim(ensure_mzsim_library())


@pytest.fixture
def chip(library: ctypes.CDLL) -> Iterator[VirtualChip]:
    with VirtualChip(library) as chip:
        yield chip
