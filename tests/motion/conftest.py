"""A controller with the measuring settings: 250 steps/mm, 5000 mm/min, 500 mm/s2."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from motion_host import BASELINE, Host


@pytest.fixture
def host() -> Iterator[Host]:
    controller = Host()
    controller.settings(**BASELINE, s11=0.01, s12=0.002)
    yield controller
    controller.close()
