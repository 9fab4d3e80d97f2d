"""Positions become segments without losing a fraction of a step, and two clocks do not drift apart."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.linuxcnc.slices import CommandError, Slicer

TICK_S = 0.01


@given(
    start=st.lists(st.integers(-(10**6), 10**6), min_size=6, max_size=6),
    scale=st.floats(0.1, 2000).map(lambda value: value * (-1 if value > 1000 else 1)),
    positions=st.lists(st.floats(-1000, 1000), min_size=1, max_size=50),
)
def test_the_sum_of_all_segments_is_where_the_last_command_is(
    start: list[int], scale: float, positions: list[float]
) -> None:
    slicer = Slicer([scale] * 2, 0.1)
    slicer.begin(start)
    segments = [slicer.slice([position, -position], TICK_S, 0.1) for position in positions]
    total = [sum(segment.steps[axis] for segment in segments) + start[axis] for axis in range(6)]
    assert total == [round(positions[-1] * scale), round(-positions[-1] * scale), *start[2:]]
    assert slicer.position(0, total[0]) == pytest.approx(positions[-1], abs=0.5001 / abs(scale))


@pytest.mark.parametrize("clock", [0.9995, 1.0, 1.0005])
def test_the_queue_keeps_its_level_whatever_the_clocks_do(clock: float) -> None:
    """The device's clock is off by 500 ppm, ten times what a quartz is; ticks are uneven; ten minutes."""
    random.seed(3)
    slicer = Slicer([200.0], 0.1)
    queued = slicer.begin([0] * 6).duration_us / 1e6
    lowest, highest = math.inf, 0.0
    for tick in range(60_000):
        seconds = random.uniform(0.009, 0.011)
        segment = slicer.slice([tick * 0.01], seconds, queued)
        queued += segment.duration_us / 1e6 - seconds * clock
        lowest, highest = min(lowest, queued), max(highest, queued)
    assert lowest > 0.08 and highest < 0.12


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e9])
def test_a_command_that_is_no_position_is_refused(wrong: float) -> None:
    slicer = Slicer([200.0], 0.1)
    slicer.begin([5] * 6)
    with pytest.raises(CommandError):
        slicer.slice([wrong], TICK_S, 0.1)
    assert slicer.steps == [5] * 6


@pytest.mark.parametrize("scales", [[0.0], [math.nan], [1.0] * 7])
def test_scales_that_cannot_be(scales: list[float]) -> None:
    with pytest.raises(ValueError, match="at most six"):
        Slicer(scales, 0.1)


def test_after_a_halt_the_queue_is_soon_back_at_its_level() -> None:
    slicer = Slicer([200.0], 0.1)
    queued = slicer.begin([0] * 6).duration_us / 1e6 + 0.5
    for _ in range(1000):  # 10 s
        queued += slicer.slice([0.0], TICK_S, queued).duration_us / 1e6 - TICK_S
    assert 0.1 < queued < 0.21


def test_a_servo_thread_that_catches_up_is_not_faster_than_the_axes() -> None:
    slicer = Slicer([200.0, 200.0], 0.1, [10_000, 5_000])
    slicer.begin([0] * 6)
    assert slicer.slice([5.0, 1.0], 0.001, 0.1).duration_us == 100_000, "1000 steps at 10 000 steps/s"
    assert slicer.slice([5.0, 6.0], 0.001, 0.1).duration_us == 200_000, "1000 steps at 5 000 steps/s"


def test_a_tick_that_took_long_is_no_long_segment() -> None:
    slicer = Slicer([200.0], 0.1)
    slicer.begin([0] * 6)
    assert slicer.slice([0.0], 30.0, 0.1).duration_us == 500_000
    assert slicer.slice([0.0], 0.0, 0.1).duration_us == 1000
