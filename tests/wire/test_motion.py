"""Timed segments: every step, in exactly the time, inside the limits."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from wificnc.connection.wmc3.layout import Estop, Hold, JogStop, ProbeLast, Reset, Resume, Segment, SegmentFlag, State
from wire_device import ACCEL, PATIENT, RATE, TIMER_HZ, Device

SLICE_S = 0.01


def segment(*steps: int, us: int = 10_000, flags: int = 0, ident: int = 0) -> Segment:
    return Segment(steps=(*steps, *[0] * (6 - len(steps))), duration_us=us, flags=flags, id=ident)


def profile(distance: int, speed: float, accel: float) -> list[int]:
    """Steps of each 10 ms of a trapezoid, as a host that keeps the limits makes them."""
    t_up = speed / accel
    if speed * t_up > distance:
        t_up = (distance / accel) ** 0.5
        speed = accel * t_up
    total = distance / speed + t_up

    def where(t: float) -> float:
        if t < t_up:
            return accel * t * t / 2
        if t > total - t_up:
            return distance - accel * max(0.0, total - t) ** 2 / 2
        return speed * (t - t_up / 2)

    ticks = int(total / SLICE_S) + 2
    points = [round(where(min(n * SLICE_S, total))) for n in range(ticks)]
    return [b - a for a, b in itertools.pairwise(points)]


def speeds(device: Device, axis: int, window_s: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """Mean speed in windows, steps/s, and their times."""
    t, direction = device.edges(axis)
    grid = np.arange(t[0] - window_s, t[-1] + 2 * window_s, window_s)
    position = np.concatenate([[0], np.cumsum(direction)])
    return grid[1:], np.diff(position[np.searchsorted(t, grid)]) / window_s


def test_one_segment_makes_its_steps(device: Device) -> None:
    device.motion(segment(1000, 0, -500, 7, us=1_000_000))
    device.run(3)
    assert device.position == device.pulses == [1000, 0, -500, 7, 0, 0]
    assert device.status.position_steps == (1000, 0, -500, 7, 0, 0)
    assert device.status.state == State.IDLE


def test_a_queue_that_reaches_far_enough_is_executed_in_exactly_its_time(device: Device) -> None:
    """From the first step behind the start ramp to the last before the end ramp: the pace is 1."""
    device.motion(*[segment(100, us=10_000)] * 8)
    for _ in range(9):
        device.motion(*[segment(100, us=10_000)] * 8)
    device.motion(*[segment(100, us=10_000)] * 7, segment(100, us=10_000, flags=SegmentFlag.LAST))
    device.run(3)
    t, _ = device.edges(0)
    assert len(t) == 8800
    # 10 000 steps/s against 100 000 steps/s2: 0.1 s and 500 steps for each ramp
    middle = t[1000:7800]
    assert middle[-1] - middle[0] == pytest.approx(6799 / 10_000, abs=2 / TIMER_HZ)
    assert np.abs(np.diff(middle) - 1e-4).max() <= 2 / TIMER_HZ
    # the first step comes after (2 / ACCEL)^0.5 = 0.0045 s at the latest
    assert 0.88 + 0.1 - 0.0045 - 0.003 < t[-1] - t[0] < 0.88 + 0.1, "each ramp costs half its time"


def test_speed_and_acceleration_stay_inside_the_limits_whatever_the_host_asks(device: Device) -> None:
    device.motion(*[segment(200)] * 8)  # 20 000 steps/s from rest immediately: the top speed
    device.motion(*[segment(200)] * 8)
    device.motion(*[segment(-200, 150)] * 8)  # and the other way
    device.motion(*[segment(0, 150)] * 8)
    device.run(4)
    assert device.position == device.pulses == [1600, 2400, 0, 0, 0, 0]
    for axis in (0, 1):
        time, speed = speeds(device, axis)
        assert np.abs(speed).max() <= RATE * 1.001 + 500
        change = np.abs(np.diff(speed)) / np.diff(time)
        # a host's own slices may jump by what 10 ms change, and by two steps in a slice
        jump = ACCEL * SLICE_S + 2 / SLICE_S
        assert (np.abs(np.diff(speed)) <= jump + 2 / 0.002).all(), change.max()


def test_what_is_less_than_a_nanosecond_adds_up(device: Device) -> None:
    """Seven steps in 10 ms: no step comes after a whole number of ns. 1000 segments still take exactly 10 s."""
    for count in range(1000):
        device.motion(segment(7))
        if count > 20:
            device.run(0.01)
    device.run(1)
    t, _ = device.edges(0)
    assert len(t) == 7000
    assert t[6500] - t[200] == pytest.approx(6300 / 700, abs=2 / TIMER_HZ)


def test_a_host_that_uses_all_of_the_limits_loses_little_time(device: Device) -> None:
    steps = profile(20_000, 15_000, ACCEL)
    todo = [segment(n, ident=k + 1) for k, n in enumerate(steps) if n]
    todo[-1] = replace(todo[-1], flags=SegmentFlag.LAST)
    while todo:
        device.motion(*todo[:8])
        todo = todo[8:]
        device.run(0.04)
    device.run(2)
    t, _ = device.edges(0)
    assert device.pulses[0] == 20_000
    assert t[-1] - t[0] <= len(steps) * SLICE_S + 0.05, "it starts from rest, when only a fifth of the limits is left"


def test_open_loop_host_of_a_hundred_packets_a_second(device: Device) -> None:
    """As LinuxCNC's component sends: one slice of 10.00 ms every 10.10 ms, full-length packets, never an answer read.
    No ramp for each packet: the speed hardly changes."""
    sent = 0
    for n in profile(30_000, 10_000, 50_000):
        if n:
            device.motion(segment(n))
            sent += n
        device.run(0.0101)
    device.run(1)
    assert device.pulses[0] == sent == 30_000
    t, _ = device.edges(0)
    middle = t[10_000:20_000]
    rate = 1 / np.diff(middle)
    assert rate.min() > 9_000 and rate.max() < 10_001 * 1.01
    assert device.status.state == State.IDLE


def test_a_late_host_costs_a_pause_with_ramps_and_no_step(device: Device) -> None:
    for _ in range(4):
        device.motion(*[segment(100)] * 8)
    device.run(1.0)
    assert device.status.state == State.IDLE
    for _ in range(4):
        device.motion(*[segment(100)] * 8)
    device.run(1.0)
    assert device.pulses[0] == 6400
    time, speed = speeds(device, 0, 0.005)
    assert (np.abs(np.diff(speed)) <= ACCEL * 0.005 + 2 / 0.005).all()
    assert (np.diff(time) > 0).all()


def test_hold_stops_on_the_path_and_resume_loses_nothing(device: Device) -> None:
    for _ in range(10):
        device.motion(*[segment(100, 50)] * 8)
    device.run(0.3)
    device.send(Hold())
    device.run(0.2)
    held = device.position
    assert device.status.state == State.HOLD
    assert 0 < held[0] < 8000 and abs(held[1] - held[0] / 2) <= 1, "on the line"
    device.run(0.5)
    assert device.position == held, "it is at rest"
    device.send(Resume())
    device.run(2)
    assert device.position == device.pulses == [8000, 4000, 0, 0, 0, 0]
    for axis in (0, 1):
        _, speed = speeds(device, axis, 0.005)
        assert (np.abs(np.diff(speed)) <= ACCEL * 0.005 + 2 / 0.005).all()


@pytest.mark.parametrize("at_ms", range(5, 400, 37))
def test_hold_anywhere(make_device: Callable[..., Device], at_ms: int) -> None:
    device = make_device()
    for n in range(5):
        device.motion(*[segment(30 + 10 * n, -20 * n, 3)] * 8)
    device.run(at_ms / 1000)
    device.send(Hold())
    device.run(0.5)
    device.send(Resume())
    device.run(2)
    assert device.position == device.pulses == [8 * sum(30 + 10 * n for n in range(5)), -8 * 200, 120, 0, 0, 0]


def test_the_text_sides_hold_and_resume_act_too(device: Device) -> None:
    for _ in range(10):
        device.motion(*[segment(100)] * 8)
    device.run(0.3)
    device.text("!")
    device.run(0.3)
    assert device.state == "Hold:0" and device.status.state == State.HOLD
    device.text("~")
    device.run(2)
    assert device.pulses[0] == 8000


def test_a_dwell_is_waited(device: Device) -> None:
    device.motion(segment(100), segment(us=500_000), segment(100))
    device.run(2)
    t, _ = device.edges(0)
    assert len(t) == 200
    assert 0.5 <= t[100] - t[99] <= 0.56


def test_very_slow_segments(device: Device) -> None:
    """One step in two seconds; and a hold in the middle of waiting acts immediately."""
    device.motion(segment(1, us=2_000_000), segment(1, us=2_000_000))
    device.run(3.0)
    device.send(Hold())
    device.run(0.1)
    assert device.status.state == State.HOLD and device.pulses[0] == 1
    device.send(Resume())
    device.run(5)
    t, _ = device.edges(0)
    assert len(t) == 2 and t[0] == pytest.approx(2.0, abs=0.1)


def test_a_thousand_segments_a_second(device: Device) -> None:
    random.seed(7)
    total = 0
    for _ in range(250):
        steps = [8 + random.randrange(-1, 2) for _ in range(8)]
        device.motion(*[segment(n, -n, us=1000) for n in steps])
        total += sum(steps)
        device.run(0.008)
    device.run(0.5)
    assert device.pulses == [total, -total, 0, 0, 0, 0]
    t, _ = device.edges(0)
    assert t[-1] - t[0] < 2.2, "0.1 s for the ramps"


def test_a_segment_beyond_the_top_speed_is_stretched(device: Device) -> None:
    device.motion(segment(400))
    device.run(1)
    assert device.pulses[0] == 400
    t, _ = device.edges(0)
    assert np.diff(t).min() >= 1 / RATE - 2 / TIMER_HZ


def test_steps_of_a_long_segment_that_cannot_be_cut_evenly(make_device: Callable[..., Device]) -> None:
    device = make_device(settings=PATIENT)
    device.motion(segment(100_003, 99_991, -33_331, 1, -2, 50_000, us=10_000_000))
    device.run(12)
    assert device.pulses == [100_003, 99_991, -33_331, 1, -2, 50_000]


def test_durations_of_zero_take_the_speeds(device: Device) -> None:
    """1000 steps/s at begin and end: (1000 steps/s)^2 x 1000 is 10^9."""
    speed_sq, last = 10**9, SegmentFlag.LAST
    device.motion(Segment((1000, 0, 0, 0, 0, 0), entry_speed_sq=speed_sq, exit_speed_sq=speed_sq, flags=last))
    device.run(2)
    t, _ = device.edges(0)
    assert len(t) == 1000 and t[-1] - t[0] == pytest.approx(1.0, abs=0.02)


def test_estop_stops_at_once_and_keeps_the_position(device: Device) -> None:
    for _ in range(10):
        device.motion(*[segment(100)] * 8)
    device.run(0.3)
    at = device.now
    device.send(Estop())
    device.run(0.2)
    t, _ = device.edges(0)
    assert t[-1] <= at + 1e-4, "no step leaves the pins after it"
    assert device.position == device.pulses
    assert device.status.state == State.ESTOP and device.status.alarm == 20
    device.motion(segment(100))
    device.run(0.5)
    assert device.position == device.pulses and len(device.edges(0)[0]) == len(t), "locked"
    device.send(Reset())
    device.run(0.2)
    assert device.status.state == State.IDLE
    device.motion(segment(100))
    device.run(0.5)
    assert device.pulses[0] == len(t) + 100


def test_the_first_status_comes_at_once_and_then_at_the_interval(device: Device) -> None:
    device.send(JogStop(axis=0xFF))
    assert len(device.sent) == 1 and device.status.state == State.IDLE
    device.run(1.0)
    times_us = np.array([sent.packet.header.timestamp_us for sent in device.sent][1:])
    assert len(times_us) == pytest.approx(20, abs=1)
    assert np.abs(np.diff(times_us) - 50_000).max() <= 2_000


def test_the_running_segments_id_is_reported(device: Device) -> None:
    device.send(JogStop(axis=0xFF))
    device.motion(*[segment(50, us=100_000, ident=n + 1) for n in range(8)])
    seen = []
    for _ in range(20):
        device.run(0.05)
        seen.append(device.status.segment_id)
    running = [ident for ident in seen if ident]
    assert running == sorted(running) and set(running) == set(range(1, 9))


def test_a_probe_segment_stops_at_the_contact(device: Device) -> None:
    device.lib.virtual_surface(device.host, -500)
    device.send(JogStop(axis=0xFF))
    device.motion(segment(0, 0, -2000, us=2_000_000, flags=SegmentFlag.PROBE), segment(100))
    device.run(2)
    results = [sent.packet.payload for sent in device.sent if sent.data[5] == 0x23]
    assert len(results) == 1
    result = results[0]
    assert result.contact == 1 and result.position_steps == (0, 0, -500, 0, 0, 0)  # type: ignore[attr-defined]
    assert device.request(device.connect(), ProbeLast()).payload == result, "the datagram may be lost: ask"
    assert device.position[2] >= -520 and device.position[0] == 0, "slowed down, and the rest dropped"


def test_a_probe_segment_without_contact_says_so(device: Device) -> None:
    device.motion(segment(0, 0, -200, us=500_000, flags=SegmentFlag.PROBE), segment(100))
    device.run(2)
    results = [sent.packet.payload for sent in device.sent if sent.data[5] == 0x23]
    assert [(r.contact, r.position_steps[2]) for r in results] == [(0, -200)]  # type: ignore[attr-defined]
    assert device.position == [100, 0, -200, 0, 0, 0]
