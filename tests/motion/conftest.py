"""A controller with the measuring settings: 250 steps/mm, 5000 mm/min, 500 mm/s2."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from motion_host import BASELINE, Host


@pytest.fixture
def host() -> Iterator[Host]:
    controller = Host()
    controller.settings(**BASELINE, s11=0.01, s12=0.002)
    yield controller
    controller.close()
