"""$78: which gap in the packet numbers of a host without a stream is lost motion. A stock LinuxCNC host takes two
numbers every 10 ms, for motion and for outputs, and sends no motion without steps: its gaps are normal."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator

import pytest
from test_motion import segment
from test_session import statistics
from wificnc.connection.wmc3.layout import IoControl, Motion, Resume, State
from wificnc.connection.wmc3.packet import build
from wire_device import Device

SLICE_US, SLICE_S = 10_000, 0.01
SCALE = 200  # steps/mm
ACCEL = 450.0  # mm/s2 of the host; the device allows 500
OFF, LOST, ALL = 0, 1, 2  # $78


def trapezoid(mm: float, feed_mm_s: float) -> Iterator[float]:
    """Where a host is at the end of each slice of a move from rest to rest, mm."""
    ramp_s = min(feed_mm_s / ACCEL, (abs(mm) / ACCEL) ** 0.5)
    top = ramp_s * ACCEL
    whole_s = 2 * ramp_s + (abs(mm) - top * ramp_s) / top
    slices = int(whole_s / SLICE_S) + 1
    for n in range(1, slices + 1):
        t = min(n * SLICE_S, whole_s)
        begin, end = min(t, ramp_s), max(0.0, t - (whole_s - ramp_s))
        way = ACCEL * begin**2 / 2 + top * max(0.0, min(t, whole_s - ramp_s) - ramp_s) + top * end - ACCEL * end**2 / 2
        yield way if mm > 0 else -way


def program() -> list[tuple[int, int]]:
    """Steps of X and Y in each slice: rapids, pauses, corners, and feeds with slices that have no step."""
    moves = [(20.0, 0, 80.0), (0, -15.0, 60.0), (0.4, 0, 0.3), (-12.0, 9.0, 70.0), (0, 0, 0), (8.0, 0, 20.0)]
    slices, at = [], [0, 0]
    begin = [0.0, 0.0]
    for x, y, feed in moves:
        length = (x * x + y * y) ** 0.5
        ways = list(trapezoid(length, feed)) if length else [0.0] * 30
        for way in ways:
            part = way / length if length else 0.0
            to = [int((begin[0] + x * part) * SCALE), int((begin[1] + y * part) * SCALE)]
            slices.append((to[0] - at[0], to[1] - at[1]))
            at = to
        begin = [begin[0] + x, begin[1] + y]
    return slices


def run_stock_host(device: Device, lost: set[int], lost_outputs: set[int] | None = None) -> None:
    """lost: slices whose motion the network loses."""
    device.raw(build(IoControl(), 1, 1))
    number = 2
    for n, steps in enumerate([(0, 0)] * 50 + program()):
        at_us = round(device.now * 1e6)
        if any(steps) and n - 50 not in lost:
            device.raw(build(Motion(count=1), number, at_us, [segment(*steps, us=SLICE_US)]))
        if n - 50 not in (lost_outputs or set()):
            device.raw(build(IoControl(), number + 1, at_us))
        number += 2
        device.run(SLICE_S)
        if device.state.startswith("Hold"):
            break
    device.sequence = number
    device.run(0.5)


FAST = [n for n, (x, y) in enumerate(program()) if abs(x) + abs(y) > 40]


def test_a_stock_host_on_a_good_network_is_never_held(device: Device) -> None:
    run_stock_host(device, set())
    assert device.state == "Idle" and "lost" not in device.heard()
    assert device.pulses[:2] == [sum(each[axis] for each in program()) for axis in (0, 1)]
    assert statistics(device).missing > 100, "though it skips numbers all the time"


@pytest.mark.parametrize("seed", range(8))
def test_motion_that_a_network_loses_is_a_hold(device: Device, seed: int) -> None:
    dice = random.Random(seed)
    run_stock_host(device, {dice.choice([n for n in FAST if n - 1 in FAST and n + 1 in FAST])})
    assert device.state == "Hold:0"
    assert "[MSG:Remote host: motion was lost, feed hold]" in device.heard()


def test_lost_outputs_are_no_lost_motion(device: Device) -> None:
    """They are repeated 10 ms later."""
    run_stock_host(device, set(), lost_outputs=set(FAST[14::7]))
    assert device.state == "Idle"


@pytest.mark.parametrize("mode", [OFF, LOST, ALL])
def test_the_least_gap_of_a_host_that_skips_nothing(make_device: Callable[..., Device], mode: int) -> None:
    """Slow motion that could have been a rest: only $78=2 takes every gap for a loss."""
    for steps, holds in ((5, mode == ALL), (200, mode != OFF)):
        device = make_device(settings={78: mode})
        for number in (1, 2, 4):
            device.raw(build(Motion(count=1), number, number, [segment(steps, us=SLICE_US)]))
        device.sequence = 5
        device.run(1)
        assert (device.state == "Hold:0") == holds


def test_a_gap_of_a_host_that_only_switches_holds_no_job_of_the_text_side(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={78: ALL})
    device.raw(build(IoControl(misc_outputs=1), 1, 1))
    device.text("G1 X5 F600\n")
    device.run(0.1)
    device.raw(build(IoControl(misc_outputs=1), 5, 5))
    device.sequence = 6
    device.run(0.1)
    assert device.state == "Run"


def test_the_loss_is_told_once_in_each_hold(make_device: Callable[..., Device]) -> None:
    device = make_device()
    for _ in range(2):
        for _ in range(40):
            device.motion(*[segment(100)] * 8)  # more than the queue has room for
        device.run(1)
        assert device.status.state == State.HOLD
        assert device.heard().count("[MSG:Remote host: motion was lost, feed hold]") == 1
        device.send(Resume())
        device.run(3)


def test_a_datagram_that_was_only_late_is_no_gap(device: Device) -> None:
    """Outputs that overtake motion cost nothing."""
    for number in (1, 3, 2, 4):
        payload = IoControl() if number == 3 else Motion(count=1)
        device.raw(build(payload, number, number, [segment(100)] if number != 3 else ()))
    device.sequence = 5
    device.run(1)
    assert (device.state, device.pulses[0]) == ("Idle", 300)
