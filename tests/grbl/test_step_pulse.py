"""$0: what a new board begins with is long enough for common drivers, and the controller says what a pulse costs."""

from __future__ import annotations

import pytest
from grbl_host import Grbl
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board
from wificnc.board.rules import step_spread_ns
from wificnc.serve.options import board_numbers
from wificnc.sim.native import HostBoard

# Shortest step pulse and pause, data sheets: A4988 1.0, DRV8825 1.9, TB6600 (TB67S109A) 0.5, DM542 2.5 us
NEEDED_NS = 2_500
FOR_MOTORS = [path.stem for path in find_boards() if load_board(path).target == "esp32"]


def started(board: Board) -> Grbl:
    numbers = dict(board_numbers(board))
    numbers["axis_count"] = numbers.pop("axes")
    controller = Grbl(board=HostBoard(**numbers))
    controller.send("")
    return controller


@pytest.fixture(params=FOR_MOTORS)
def board(request: pytest.FixtureRequest) -> Board:
    return load_board(str(request.param))


def pulse_us(controller: Grbl) -> int:
    return int(controller.send("$$\n").split("$0=")[1].split("\r")[0])


def test_a_new_board_makes_pulses_that_drivers_take(board: Board) -> None:
    controller = started(board)
    assert pulse_us(controller) * 1000 >= NEEDED_NS
    controller.fine("$0=5")
    controller.send("$RST=$\n")
    assert pulse_us(controller) * 1000 >= NEEDED_NS
    controller.close()


def test_what_the_pulse_leaves_of_the_rate_is_said(board: Board) -> None:
    """A step is the pulse, a pause as long, and the engine's own time: 3 us leave 160,000 steps/s by GPIO."""
    controller = started(board)
    controller.fine("$100=1000")
    most = round(60 * (10**9 // (6000 + step_spread_ns(board))) / 1000)
    assert controller.send("$110=15000\n") == (
        f"[MSG:$110 is limited to {most} mm/min by the step pulse: $0=3]\r\nok\r\n"
    )
    controller.close()


def test_the_boards_own_pulse_is_shorter_than_its_number(board: Board) -> None:
    """1.8 us is what 250,000 steps/s take; $0 has whole microseconds, and is not taken for 2.0."""
    controller = started(board)
    controller.fine("$100=1000", "$110=9000")
    own = board.timing.step_pulse_ns
    assert controller.send(f"$0={-(-own // 1000)}\n") == f"[MSG:Step pulses of {own / 1000:.1f} us]\r\nok\r\n"
    controller.fine("$110=15000")
    controller.close()


def test_a_board_without_such_a_pulse_begins_with_its_own() -> None:
    controller = started(load_board("host"))
    assert pulse_us(controller) == 1
    controller.fine("$0=1")
    controller.close()
