"""A dial at the pins of the real image: each edge interrupts, and its detents move the axis."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from chip_controller import Controller
from wificnc.board.model import Board
from wificnc.build.image import Block

pytestmark = pytest.mark.slow  # builds an image of its own; tests/dial has quick ones

LINES = ((0, 0), (1, 0), (1, 1), (0, 1))  # A before B: forwards


@pytest.fixture(scope="module")
def controller(laden_board: Board, laden_image: tuple[Block, ...]) -> Iterator[Controller]:
    with Controller(laden_board, laden_image) as controller:
        for signal in ("dial_a", "dial_b", "dial_x10", "dial_axis_y"):
            controller.at(0.0, signal, 1)  # open, by its pull
        controller.boot()
        controller.fine("$401=0.1", "$402=1800", "$111=6000", "$121=500")
        yield controller


def turn(controller: Controller, detents: int, edge_s: float) -> None:
    """Four edges a detent. Lines are active low; at rest both are open."""
    sign = 1 if detents > 0 else -1
    for n in range(1, 4 * abs(detents) + 1):
        before, now = (LINES[sign * m % 4] for m in (n - 1, n))
        line = int(before[1] != now[1])
        controller.at(n * edge_s, ("dial_a", "dial_b")[line], 1 - now[line])


def y_steps(controller: Controller) -> int:
    return controller.stands()[1]


def test_detents_move_the_selected_axis(controller: Controller) -> None:
    each = round(0.1 * float(controller.send("$$").split("$101=")[1].split("\r\n")[0]))
    turn(controller, 3, 0.002)
    assert "Dial ignored" in controller.run(0.8)  # no axis is selected
    assert controller.stands()[:3] == [0, 0, 0]
    controller.at(0.0, "dial_axis_y", 0)
    controller.run(0.3)
    turn(controller, 5, 0.002)
    controller.run(1.0)
    assert y_steps(controller) == 5 * each
    turn(controller, -2, 0.0003)  # faster than a sample every ms could see
    controller.run(1.0)
    assert y_steps(controller) == 3 * each
    controller.at(0.0, "dial_x10", 0)
    controller.run(0.01)
    turn(controller, 1, 0.002)
    controller.run(1.0)
    assert y_steps(controller) == 13 * each
    assert controller.stands()[0] == controller.stands()[2] == 0
    assert controller.state() == "Idle"


def test_a_hand_beside_a_running_job_changes_nothing(controller: Controller) -> None:
    before = y_steps(controller)
    controller.fine("G91", "G1X3F600")
    turn(controller, 8, 0.002)
    controller.run(2.0)
    assert y_steps(controller) == before
    assert controller.state() == "Idle"
