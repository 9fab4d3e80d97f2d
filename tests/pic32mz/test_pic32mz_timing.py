"""The promised step rate holds with more than a cycle an instruction, and with the serial port busy."""

from __future__ import annotations

import numpy as np
import pytest
from chip_controller import Controller
from slow import deep_but
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import ESTIMATE, Timing

TIMINGS = {f"{cycles} cycles": Timing(instruction=cycles) for cycles in (1.0, 1.5, 2.0)} | {"caches": ESTIMATE}
MOVE = "G91G1X200Y199.5Z199A198.5F20000"  # 2.7 s, longer than the port takes for the requests below
GAP_US = 1.0  # a step may come so much later or earlier after the one before than planned


@pytest.mark.slow
@pytest.mark.parametrize("timing", deep_but("caches".__eq__, TIMINGS))
def test_the_promised_rate_holds(board: Board, image: tuple[Block, ...], timing: str) -> None:
    """Four axes at the board's rate, requests and lines without a pause: no gap, no loss, no underrun."""
    rate = board.timing.max_step_rate_hz
    with Controller(board, image) as controller:
        controller.chip.timing(TIMINGS[timing])
        controller.run(0.05)
        for axis in range(4):
            controller.fine(f"$11{axis}=4500", f"$10{axis}=4000", f"$12{axis}=8000")
        controller.fine(MOVE)
        controller.run(0.6)
        controller.steps()
        controller.chip.write(b"\n" * 300 + b"?" * 6000)
        begin, taken = controller.chip.cycles, in_interrupts(controller)
        controller.run(0.5)
        load = (in_interrupts(controller) - taken) / (controller.chip.cycles - begin)
        gaps_us = np.diff(controller.steps()["cycle"].astype(np.int64)) / controller.chip.cpu_hz * 1e6
        assert gaps_us.mean() == pytest.approx(1e6 / rate, rel=0.002)
        assert np.abs(gaps_us - 1e6 / rate).max() <= GAP_US
        assert load < 0.5
        assert controller.heard.count("<") > 50 and "lost bytes" not in controller.heard
        controller.chip.write(b"?" * 20_000)
        controller.rest()
        assert controller.stands() == [800_000, 798_000, 796_000, 794_000]
        assert "slowed down" not in controller.heard and "lost bytes" not in controller.heard
        pulses = controller.chip.pulses()
        assert min(pulses.high, pulses.low) / controller.chip.cpu_hz >= board.timing.step_pulse_ns * 1e-9


@pytest.mark.deep
def test_short_moves_after_a_long_one_end_where_they_should(board: Board, image: tuple[Block, ...]) -> None:
    """From two cycles an instruction on, whatever is in the store and at the serial port."""
    with Controller(board, image) as controller:
        controller.chip.timing(TIMINGS["2.0 cycles"])
        controller.run(0.05)
        for axis in range(4):
            controller.fine(f"$11{axis}=4500", f"$10{axis}=4000", f"$12{axis}=8000")
        controller.fine(MOVE)
        controller.run(0.6)
        controller.chip.write(b"G1X0.01\n" * 60)
        controller.run(3.4)
        assert controller.stands() == [802_400, 798_000, 796_000, 794_000]


def in_interrupts(controller: Controller) -> int:
    """Time spent in interrupts so far, cycles."""
    return sum(controller.chip.vector(irq).instructions for irq in range(192))
