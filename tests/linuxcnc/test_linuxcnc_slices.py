"""Positions become segments without losing a fraction of a step, and two clocks do not drift apart."""

from __future__ import annotations

import ctypes
import math
import random
from dataclasses import dataclass

import pytest
from component_library import AXES, Segment, library
from component_library import Slicer as Native
from hypothesis import given
from hypothesis import strategies as st

TICK_S = 0.01


@dataclass
class Slice:
    steps: list[int]
    duration_us: int


class Slicer:
    """linuxcnc/slicer.c, beginning where the device is."""

    def __init__(self, scales: list[float], steps: list[int] | None = None, rates: list[float] | None = None) -> None:
        positions = (ctypes.c_int32 * AXES)(*(steps or []))
        self.native = Native(len(scales), (*scales,), (*(rates or ()),), 0.1, positions)

    @property
    def steps(self) -> list[int]:
        return list(self.native.steps)

    def position(self, joint: int, steps: int) -> float:
        return float(steps / self.native.scale[joint])

    def slice(self, positions: list[float], seconds: float, queued_s: float) -> Slice | int:
        """A segment, or the joint whose position is none."""
        segment = Segment()
        command = (ctypes.c_double * AXES)(*positions)
        wrong: int = library().slicer_slice(self.native, command, seconds, queued_s, segment)
        return Slice(list(segment.steps), segment.duration_us) if wrong < 0 else wrong


@given(
    start=st.lists(st.integers(-(10**6), 10**6), min_size=6, max_size=6),
    scale=st.floats(0.1, 2000).map(lambda value: value * (-1 if value > 1000 else 1)),
    positions=st.lists(st.floats(-1000, 1000), min_size=1, max_size=50),
)
def test_the_sum_of_all_segments_is_where_the_last_command_is(
    start: list[int], scale: float, positions: list[float]
) -> None:
    slicer = Slicer([scale] * 2, start)
    segments = [slicer.slice([position, -position], TICK_S, 0.1) for position in positions]
    assert not any(isinstance(segment, int) for segment in segments)
    total = [sum(segment.steps[axis] for segment in segments) + start[axis] for axis in range(6)]
    assert total == [round(positions[-1] * scale), round(-positions[-1] * scale), *start[2:]]
    assert slicer.position(0, total[0]) == pytest.approx(positions[-1], abs=0.5001 / abs(scale))


@pytest.mark.parametrize("clock", [0.9995, 1.0, 1.0005])
def test_the_queue_keeps_its_level_whatever_the_clocks_do(clock: float) -> None:
    """The device's clock is off by 500 ppm, ten times what a quartz is; ticks are uneven; ten minutes."""
    random.seed(3)
    slicer = Slicer([200.0])
    queued = 0.1
    lowest, highest = math.inf, 0.0
    for tick in range(60_000):
        seconds = random.uniform(0.009, 0.011)
        segment = slicer.slice([tick * 0.01], seconds, queued)
        assert isinstance(segment, Slice)
        queued += segment.duration_us / 1e6 - seconds * clock
        lowest, highest = min(lowest, queued), max(highest, queued)
    assert lowest > 0.08 and highest < 0.12


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1e9, -1e9])
def test_a_command_that_is_no_position_is_refused(wrong: float) -> None:
    slicer = Slicer([200.0, 200.0], [5] * 6)
    assert slicer.slice([1.0, wrong], TICK_S, 0.1) == 1, "the joint that it is"
    assert slicer.steps == [5] * 6, "nothing was changed"


def test_a_way_that_does_not_fit_a_segment_is_refused() -> None:
    slicer = Slicer([1.0], [-(2**31) + 10] * 6)
    assert slicer.slice([2.0**31 - 10], TICK_S, 0.1) == 0


def test_after_a_halt_the_queue_is_soon_back_at_its_level() -> None:
    slicer = Slicer([200.0])
    queued = 0.6
    for _ in range(1000):  # 10 s
        segment = slicer.slice([0.0], TICK_S, queued)
        assert isinstance(segment, Slice)
        queued += segment.duration_us / 1e6 - TICK_S
    assert 0.1 < queued < 0.21


def test_while_it_stands_a_long_queue_is_gone_at_once() -> None:
    """What is queued would still run after LinuxCNC has switched off. Nothing is cut faster by it."""
    slicer = Slicer([200.0])
    queued = 0.9
    for _ in range(100):  # 1 s
        segment = slicer.slice([0.0], TICK_S, queued)
        assert isinstance(segment, Slice)
        queued += segment.duration_us / 1e6 - TICK_S
    assert 0.15 < queued < 0.25
    for tick in range(1, 40):  # a step now and then is no standing
        segment = slicer.slice([tick // 8 / 200], TICK_S, 0.9)
        assert isinstance(segment, Slice) and (segment.duration_us >= 8000 or tick < 8)


@pytest.mark.parametrize("queued_s", [0.0, 0.1, 0.3, 1.0, 60.0])
def test_a_cutter_feels_nothing_of_a_queue_that_is_too_long(queued_s: float) -> None:
    """Motion is at most 5 % faster or 1 % slower than LinuxCNC commands it, whatever waits."""
    segment = Slicer([200.0]).slice([0.5], TICK_S, queued_s)
    assert isinstance(segment, Slice) and 10_000 / 1.053 <= segment.duration_us <= 10_100


@pytest.mark.parametrize(
    ("seconds", "command", "expected_us"),
    [
        (0.001, [5.0, 1.0], 100_000),  # 1000 steps at 10 000 steps/s
        (0.001, [0.0, 5.0], 200_000),  # 1000 steps at 5 000 steps/s
        (0.3, [5.0, 1.0], 300_000),  # slower than both
    ],
)
def test_a_servo_thread_that_catches_up_is_not_faster_than_the_axes(
    seconds: float, command: list[float], expected_us: int
) -> None:
    slicer = Slicer([200.0, 200.0], rates=[10_000, 5_000])
    segment = slicer.slice(command, seconds, 0.1)
    assert isinstance(segment, Slice) and segment.duration_us == expected_us


def test_a_tick_that_took_long_is_no_long_segment() -> None:
    for seconds, duration_us in ((30.0, 500_000), (0.0, 1000)):
        segment = Slicer([200.0]).slice([0.0], seconds, 0.1)
        assert isinstance(segment, Slice) and segment.duration_us == duration_us


@pytest.mark.parametrize(("command", "joint"), [(25.01, 0), (-25.01, 0), (24.9, -1), (math.nan, 0)])
def test_what_is_further_away_than_it_gets_in_time_is_far(command: float, joint: int) -> None:
    """10 000 steps/s, 200 steps a unit, half a second: 25 units, and a step."""
    slicer = Slicer([200.0, 200.0], rates=[10_000, 10_000])
    position = (ctypes.c_double * AXES)(command)
    assert library().slicer_far(slicer.native, position, 0.5) == joint
