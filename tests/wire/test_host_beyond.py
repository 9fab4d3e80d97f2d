"""A host that asks for more acceleration than the axes have: slower on the same path, and never beyond the limits."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
import stalls
from test_motion import segment
from test_stream import Network, open_stream, run_all
from wire_device import ACCEL, TIMER_HZ, Device

WINDOW_S = 0.010


def run_stream(device: Device, steps: list[int], us: int) -> None:
    sender = open_stream(device)
    network = Network(device, 1, loss=0.0, double=0.0, delay_s=(0.001, 0.002))
    sender.put([segment(n, us=us) for n in steps], last=True)
    run_all(network, sender, 60)
    assert device.position[0] == device.pulses[0] == sum(steps)


def worst(device: Device) -> float:
    """Greatest change of the mean speed from a window to the next one, in windows that slide by 1 ms.

    As a part of what the acceleration allows; a step at each end of both is rounding."""
    t, direction = device.edges(0)
    place = np.concatenate([[0], np.cumsum(direction)])
    grid = np.arange(t[0] - 3 * WINDOW_S, t[-1] + 3 * WINDOW_S, 0.001)
    at = place[np.searchsorted(t, grid, side="right")]
    n = round(WINDOW_S / 0.001)
    second = np.abs(at[2 * n :] - 2 * at[n:-n] + at[: -2 * n]).max() - 4
    return float(second / (ACCEL * WINDOW_S**2))


def leaps(rng: random.Random, us: int) -> list[int]:
    """Even speeds that change immediately, by more than two steps in a slice, which may be rounding."""
    speeds = [500, 2000, 4000, 8000, 16000] if us > 1000 else [4000, 8000, 16000]
    rates = [rng.choice([-1, 1]) * rng.choice(speeds) for _ in range(12)]
    return [round(rate * us * 1e-6) for rate in rates for _ in range(round(rng.uniform(0.02, 0.1) * 1e6 / us))]


def too_steep(times: float, us: int) -> list[int]:
    """Up to 15 000 steps/s and down again, with so many times the acceleration."""
    up_s = 15_000 / (times * ACCEL)
    grid = np.arange(0, 2 * up_s + 0.2 + us * 1e-6, us * 1e-6)
    rate = np.interp(grid, [0, up_s, up_s + 0.2, 2 * up_s + 0.2], [0, 15_000, 15_000, 0])
    place = np.round(np.cumsum(rate) * us * 1e-6).astype(int)
    return [int(n) for n in np.diff(place)] or [0]


@pytest.mark.parametrize("late", ["", "both"])
@pytest.mark.parametrize("us", [10_000, 4_000, 1_000])
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_leaps(make_device: Callable[..., Device], seed: int, us: int, late: str) -> None:
    device, rng = make_device(), random.Random(f"{seed} {us}")
    steps = leaps(rng, us)
    if late:
        stalls.stall_often(device.lib, device.host, rng, stalls.LATE[late], TIMER_HZ, 10)
    run_stream(device, steps, us)
    assert worst(device) <= 1.2


@pytest.mark.parametrize("us", [10_000, 4_000, 1_000])
@pytest.mark.parametrize("times", [1.15, 1.5, 3])
def test_ramps_that_are_too_steep(make_device: Callable[..., Device], times: float, us: int) -> None:
    device = make_device()
    steps = too_steep(times, us)
    run_stream(device, steps, us)
    assert worst(device) <= 1.2
    t, _ = device.edges(0)
    assert t[-1] - t[0] <= 2 * (2 * 15_000 / ACCEL + 0.2), "not much slower than it must be"
