"""Stalls and task periods of a host controller (targets/pc/host.h): what tests of any folder need of them."""

from __future__ import annotations

import ctypes
import os
import random
from collections.abc import Collection, Sequence
from enum import IntEnum
from typing import Any

from c_library import HostLibrary
from layouts import HOST
from slow import slow_but


class Side(IntEnum):
    """enum host_side: what can be kept from working."""

    CONTROLLER = 0
    MOTION = 1
    READER = 2


SIDES = tuple(Side)

# Which sides are late, by name: one of them, or some at the same time.
LATE: dict[str, Sequence[Side]] = {
    "controller": [Side.CONTROLLER],
    "motion": [Side.MOTION],
    "both": [Side.CONTROLLER, Side.MOTION],
    "all": list(Side),
}


def stall(lib: HostLibrary, host: int, side: Side, after_s: float, for_s: float, timer_hz: int) -> None:
    """Keep a side from working, from after_s after now on."""
    from_ticks = int(lib.host_time_ticks(host)) + round(after_s * timer_hz)
    assert lib.host_stall(host, side, from_ticks, round(for_s * timer_hz))


def stall_randomly(
    lib: HostLibrary,
    host: int,
    seed: int,
    sides: Collection[Side] = SIDES,
    gap_ms: int = 100,
    longest_ms: int = 50,
) -> None:
    """Stalls from now on, one at a time; an empty `sides` ends them. The same seed gives the same stalls."""
    stalls = HOST.struct("host_random_stalls")(seed, sum(1 << side for side in sides), gap_ms, longest_ms)
    lib.host_stall_randomly(host, ctypes.byref(stalls))


def stall_often(
    lib: HostLibrary, host: int, rng: random.Random, sides: Sequence[Side], timer_hz: int, count: int = 30
) -> None:
    """From now on, with pauses of 20 to 400 ms: one of the sides, or all of them together, for 10 to 800 ms."""
    after_s = rng.uniform(0.0, 0.3)
    for _ in range(count):
        for_s = rng.choice([0.01, 0.03, 0.06, 0.1, 0.3, 0.8])
        for side in sides if rng.random() < 0.5 else [rng.choice(sides)]:
            stall(lib, host, side, after_s, for_s, timer_hz)
        after_s += for_s + rng.uniform(0.02, 0.4)


def seeds(few: int) -> list[Any]:
    """Seeds of a test: a few, or as many as WIFICNC_STALL_SEEDS says for a longer look. A quarter of them is quick, and
    half of them are left to the slices of CI."""
    every = range(int(os.environ.get("WIFICNC_STALL_SEEDS", few)))
    return slow_but(lambda seed: seed < max(1, few // 4), every, lambda seed: seed < (few + 1) // 2)
