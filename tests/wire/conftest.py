"""Devices of the binary protocol in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from wire_device import Device


@pytest.fixture
def make_device() -> Iterator[Callable[..., Device]]:
    """Devices with their own settings, closed at the end."""
    made: list[Device] = []

    def make(**arguments: Any) -> Device:
        made.append(Device(**arguments))
        return made[-1]

    yield make
    for device in made:
        device.close()


@pytest.fixture
def device(make_device: Callable[..., Device]) -> Device:
    """200 steps/mm, 20 000 steps/s, 100 000 steps/s2 on six axes."""
    return make_device()
