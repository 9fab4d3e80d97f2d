"""A host's segments, jogs and homing while sides of the firmware stall: no jump of speed, and every step once."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
import stalls
from test_motion import profile, segment, speeds
from test_stream import Network, open_stream, run_all
from wire_device import ACCEL, PATIENT, TIMER_HZ, Device

WINDOW_S = 0.010


def assert_smooth(device: Device, axis: int) -> None:
    """1.2 times the acceleration from window to window, and a step at each end of both."""
    t, speed = speeds(device, axis, WINDOW_S)
    jump = np.abs(np.diff(speed))
    worst = int(jump.argmax())
    assert jump[worst] <= 1.2 * ACCEL * WINDOW_S + 2 / WINDOW_S, (t[worst], speed[worst - 2 : worst + 4])


def put_line(device: Device, count: int) -> None:
    for _ in range(count):
        device.motion(*[segment(80)] * 8)


@pytest.mark.alike(4)
@pytest.mark.slow
@pytest.mark.parametrize("longest_ms", [10, 50, 250, 1000])
@pytest.mark.parametrize("seed", range(4))
def test_a_stream_survives_stalls(make_device: Callable[..., Device], seed: int, longest_ms: int) -> None:
    device = make_device()
    sender = open_stream(device)
    network = Network(device, seed, loss=0.05, double=0.05, delay_s=(0.001, 0.005))
    steps = profile(20_000, 8_000, ACCEL)
    steps = [*steps, *[-n for n in steps]]
    sender.put([segment(n, n // 2, ident=k % 65536) for k, n in enumerate(steps)], last=True)
    stalls.stall_randomly(device.lib, device.host, seed, gap_ms=2 * longest_ms, longest_ms=longest_ms)
    run_all(network, sender, 120)
    assert device.position == device.pulses == [0, sum(n // 2 for n in steps), 0, 0, 0, 0]
    assert len(device.edges(0)[0]) == sum(abs(n) for n in steps), "not one step more on the way"
    for axis in (0, 1):
        assert_smooth(device, axis)


@pytest.mark.parametrize("seed", range(6))
def test_a_hold_between_stalls_loses_no_step(make_device: Callable[..., Device], seed: int) -> None:
    device, rng = make_device(), random.Random(seed)
    put_line(device, 12)
    stalls.stall_randomly(device.lib, device.host, seed, gap_ms=50, longest_ms=100)
    device.run(rng.uniform(0.1, 0.6))
    device.text("!")
    device.run(2)
    held = device.pulses[0]
    device.run(1)
    assert device.pulses[0] == held < 7_680
    device.text("~")
    device.run(4)
    assert device.position == device.pulses == [7_680, 0, 0, 0, 0, 0]
    assert_smooth(device, 0)


@pytest.mark.parametrize("sides", [[stalls.Side.CONTROLLER], [stalls.Side.MOTION], list(stalls.SIDES)])
def test_a_stall_in_mid_stream_ends_in_a_stop(make_device: Callable[..., Device], sides: list[stalls.Side]) -> None:
    device = make_device(settings=PATIENT)
    put_line(device, 12)
    for side in sides:
        stalls.stall(device.lib, device.host, side, 0.4, 1.0, TIMER_HZ)
    device.run(1.2)
    t, _ = device.edges(0)
    assert 0.4 < t[-1] < 0.4 + 0.06 + 8_000 / ACCEL + 0.01, "50 ms of motion, then the stop"
    device.run(4)
    assert device.position == device.pulses == [7_680, 0, 0, 0, 0, 0]
    assert_smooth(device, 0)
