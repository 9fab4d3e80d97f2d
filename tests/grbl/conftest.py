"""A controller that has said its banner: 3 axes, 250 steps/mm, 5000 mm/min, 500 mm/s2."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from grbl_host import Grbl

FAST = {f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)}


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**FAST)
    yield controller
    controller.close()
