"""One controller, and one client of it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from core_bridge import Bridge
from sender import talk
from wificnc.connection.client import Client


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    with Bridge() as controller:
        yield controller


@pytest.fixture
def client(bridge: Bridge) -> Iterator[Client]:
    with talk(bridge) as one:
        yield one
