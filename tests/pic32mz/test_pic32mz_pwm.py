"""The spindle's PWM at the pin of the real image: $33 to $36."""

from __future__ import annotations

from itertools import pairwise

import pytest
from chip_controller import Controller
from wificnc_chips.pic32mz import CPU_HZ

TIMER_HZ = 50_000_000  # PBCLK3


def levels(controller: Controller, seconds: float) -> list[tuple[int, int]]:
    """(cycle, level) of the pin's edges in this time."""
    controller.chip.edges()
    controller.run(seconds)
    pwm = controller.pin("spindle_pwm")
    return [(cycle, level) for cycle, pin, level in controller.chip.edges() if pin == pwm]


def highs(edges: list[tuple[int, int]]) -> list[int]:
    """Cycles of each whole pulse."""
    return [fall - rise for (rise, up), (fall, _) in pairwise(edges) if up]


@pytest.mark.parametrize("hz", [50, 333, 1000, 20_000, 50_000])
def test_frequency_and_duty(controller: Controller, hz: int) -> None:
    """$33 within 0.1 %, and a quarter of each period high, to the timer's count."""
    controller.chip.record_edges(True)
    controller.fine(f"$33={hz}", "M3S250")
    controller.run(2 / hz)
    edges = levels(controller, 10 / hz)
    periods = {b - a for a, b in pairwise([cycle for cycle, level in edges if level])}
    assert len(periods) == 1
    period = periods.pop()
    assert CPU_HZ / period == pytest.approx(hz, rel=1e-3)
    counts = max(CPU_HZ // TIMER_HZ, period // 2**15)  # cycles of a count, or more
    assert set(highs(edges)) <= set(range(period // 4 - counts, period // 4 + counts + 1))


@pytest.mark.parametrize("change", [(5000, 50), (50, 5000), (1000, 333), (50_000, 51)])
def test_a_change_of_frequency_makes_no_pulse(controller: Controller, change: tuple[int, int]) -> None:
    """Off is dark: not an edge, also with a laser."""
    controller.chip.record_edges(True)
    controller.fine("M3S500", "M5", "$32=1", f"$33={change[0]}")
    controller.run(0.05)
    controller.chip.edges()
    controller.fine(f"$33={change[1]}")
    assert levels(controller, 0.2) == []


@pytest.mark.parametrize("change", [(5000, 50), (50, 5000), (1000, 333)])
def test_a_change_of_frequency_makes_no_longer_pulse(controller: Controller, change: tuple[int, int]) -> None:
    """With $34=80 each pulse is 0.8 of the old or of the new period; the one under way may be cut short."""
    controller.chip.record_edges(True)
    controller.fine("$34=80", f"$33={change[0]}")
    controller.run(0.1)
    controller.chip.edges()
    pwm = controller.pin("spindle_pwm")
    controller.fine(f"$33={change[1]}")
    controller.run(0.2)
    edges = [(cycle, level) for cycle, pin, level in controller.chip.edges() if pin == pwm]
    pulses = highs(edges)
    old, new = (0.8 * CPU_HZ / hz for hz in change)
    odd = [high for high in pulses if high not in (pytest.approx(old, rel=2e-3), pytest.approx(new, rel=2e-3))]
    assert len(odd) <= 1 and all(high < old for high in odd)
    assert pulses[-1] == pytest.approx(new, rel=2e-3)
