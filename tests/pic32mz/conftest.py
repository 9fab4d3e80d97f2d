"""The real image of the PIC32MZ board in the virtual chip."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chip_controller import Controller
from image_fixture import board, build, image, laden_board, laden_image
from wificnc.board.model import Board
from wificnc.build.image import Block

__all__ = ["board", "build", "image", "laden_board", "laden_image"]

QUICK = "test_pic32mz_talk.py"  # of those that start the image
HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE and item.path.name != QUICK and "build" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def controller(board: Board, image: tuple[Block, ...]) -> Iterator[Controller]:
    """Booted, its banner read; 5000 mm/min, 500 mm/s2."""
    with Controller(board, image) as controller:
        controller.boot()
        for axis in range(len(board.axes)):
            controller.fine(f"$11{axis}=5000", f"$12{axis}=500")
        yield controller
