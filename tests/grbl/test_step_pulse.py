"""$0: what a new board begins with is long enough for common drivers, and the controller says what a pulse costs."""

from __future__ import annotations

import pytest
from grbl_host import Grbl
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board
from wificnc.board.rules import pulse_rate_hz, step_spread_ns
from wificnc.board.shift_registers import on_grid_ns, step_grid_ns
from wificnc.simulator.library import HostBoard
from wificnc.simulator.serve.options import board_numbers

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


def own_us(board: Board) -> int:
    """$0 of the board's own pulse."""
    return -(-board.timing.step_pulse_ns // 1000)


def test_a_new_board_makes_pulses_that_drivers_take(board: Board) -> None:
    controller = started(board)
    assert pulse_us(controller) * 1000 >= NEEDED_NS
    controller.fine("$0=6")
    controller.send("$RST=$\n")
    assert pulse_us(controller) * 1000 >= NEEDED_NS
    controller.close()


def test_what_the_pulse_leaves_of_the_rate_is_said(board: Board) -> None:
    """A step is the pulse, a pause as long, and the engine's own time: 3 us leave 160,000 events/s by GPIO, and 500
    of them are for axes of a diagonal that cannot share theirs."""
    controller = started(board)
    controller.fine("$100=1000")
    longer_us = own_us(board) + 1
    step_ns = 2 * on_grid_ns(board, 1000 * longer_us) + step_spread_ns(board)
    rate_hz = 10**9 // step_ns - 500
    assert pulse_rate_hz(board, longer_us) == rate_hz  # of `wificnc boards`
    most = round(60 * rate_hz / 1000)
    controller.send(f"$0={longer_us}\n")
    assert controller.send("$110=15000\n") == (
        f"[MSG:$110 is limited to {most} mm/min by the step pulse: $0={longer_us}]\r\nok\r\n"
    )
    controller.close()


def test_the_boards_own_pulse_is_shorter_than_its_number(board: Board) -> None:
    """1.8 us is what 250,000 steps/s take; $0 has whole microseconds, and is not taken for 2.0. What a new board
    begins with is not worth a message."""
    controller = started(board)
    controller.fine("$100=1000", "$110=7000")
    own, begins_us = board.timing.step_pulse_ns, pulse_us(controller)
    said = "" if own % 1000 == 0 or begins_us == own_us(board) else f"[MSG:Step pulses of {own / 1000:.1f} us]\r\n"
    assert controller.send(f"$0={own_us(board)}\n") == f"{said}ok\r\n"
    events_hz = 10**9 // (2 * on_grid_ns(board, own) + step_spread_ns(board))
    controller.fine(f"$110={60 * min(board.timing.max_step_rate_hz, events_hz - 500) // 1000}")
    controller.close()


def test_a_board_without_such_a_pulse_begins_with_its_own() -> None:
    controller = started(load_board("host"))
    assert pulse_us(controller) == 1
    controller.fine("$0=1")
    controller.close()


@pytest.mark.parametrize("board_id", [path.stem for path in find_boards() if step_grid_ns(load_board(path)) > 0])
def test_a_pulse_is_whole_words_of_shift_registers(board_id: str) -> None:
    """2 us each: an odd number is rounded up, and the rate follows; the hardware takes 16 words at a time."""
    board = load_board(board_id)
    grid_us = step_grid_ns(board) // 1000
    controller = started(board)
    controller.fine("$100=1000", "$0=4")
    assert controller.send("$0=5\n") == "[MSG:Step pulses of 6.0 us]\r\nok\r\n"
    assert controller.send("$110=15000\n") == "[MSG:$110 is limited to 4970 mm/min by the step pulse: $0=5]\r\nok\r\n"
    assert controller.send(f"$0={16 * grid_us + 1}\n") == "error:147\r\n"
    controller.fine("$110=100", f"$0={16 * grid_us}")
    controller.close()


def test_a_long_pulse_keeps_the_feed_of_a_diagonal(board: Board) -> None:
    """Slow diagonals have more events than steps, so that the axes step evenly: only as many as pulses leave room."""
    controller = started(board)
    controller.fine("$100=250", "$101=250", "$110=5000", "$111=5000", "$120=2000", "$121=2000", "$0=20", "G91", "G21")
    begun = controller.time()
    controller.fine("G1X40Y19F4500", "G4P0")
    length_mm, v_mm_s, accel_mm_s2 = (40**2 + 19**2) ** 0.5, 75.0, 2000.0
    assert controller.time() - begun < 1.03 * (length_mm / v_mm_s + v_mm_s / accel_mm_s2)
    controller.close()
