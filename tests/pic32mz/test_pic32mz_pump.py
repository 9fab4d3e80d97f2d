"""The charge pump at the pin of the real image, of a board that has one where the shipped one has a digital output."""

from __future__ import annotations

from itertools import pairwise

import pytest
from chip_controller import Controller
from image_fixture import PUMP_HZ
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import CPU_HZ

pytestmark = pytest.mark.slow  # builds an image of its own

NO_TIMER = "error:164"


@pytest.fixture
def board(laden_board: Board) -> Board:
    return laden_board


@pytest.fixture
def image(laden_image: tuple[Block, ...]) -> tuple[Block, ...]:
    return laden_image


def rises(controller: Controller, seconds: float) -> list[int]:
    """Cycles at which the pump's pin goes high."""
    controller.chip.edges()
    controller.run(seconds)
    pin = controller.pin("charge_pump")
    return [cycle for cycle, number, level in controller.chip.edges() if number == pin and level]


def frequency(controller: Controller) -> float:
    """Mean; each wave is within 1 us of the others, which an interrupt of the UART may take."""
    times = rises(controller, 0.02)
    waves = [b - a for a, b in pairwise(times)]
    assert max(waves) - min(waves) <= CPU_HZ // 1_000_000
    return CPU_HZ * (len(times) - 1) / (times[-1] - times[0])


def test_it_starts_at_the_boards_frequency(controller: Controller) -> None:
    controller.chip.record_edges(True)
    assert frequency(controller) == pytest.approx(PUMP_HZ, rel=2e-3)


@pytest.mark.parametrize("hz", [191, 500, 10_000, 20_000])
def test_the_setting_changes_it_and_0_ends_it(controller: Controller, hz: int) -> None:
    controller.chip.record_edges(True)
    controller.fine(f"$73={hz}")
    assert frequency(controller) == pytest.approx(hz, rel=2e-3)
    controller.fine("$73=0")
    assert rises(controller, 0.02) == []


def test_what_the_timer_cannot_make_is_refused(controller: Controller) -> None:
    controller.chip.record_edges(True)
    assert NO_TIMER in controller.send("$73=190")
    assert frequency(controller) == pytest.approx(PUMP_HZ, rel=2e-3)
