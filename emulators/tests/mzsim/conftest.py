"""The virtual chip without an image."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from wificnc_chips.pic32mz.chip import VirtualChip


@pytest.fixture
def chip() -> Iterator[VirtualChip]:
    with VirtualChip() as chip:
        yield chip
