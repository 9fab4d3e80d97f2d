"""The virtual ESP32 without a program; each instruction takes a cycle, so that tests can count them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from wificnc_chips.esp32.chip import Chip, VirtualChip


@pytest.fixture(params=list(Chip), ids=["esp32", "esp32s3"])
def chip(request: pytest.FixtureRequest) -> Iterator[VirtualChip]:
    with VirtualChip(request.param) as chip:
        chip.timing(False)
        yield chip


@pytest.fixture
def esp32() -> Iterator[VirtualChip]:
    with VirtualChip(Chip.ESP32) as chip:
        chip.timing(False)
        yield chip
