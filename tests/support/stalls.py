"""Stalls and task periods of a host controller (targets/pc/host.h): what tests of any folder need of them."""

from __future__ import annotations

import ctypes
import os
import random
from collections.abc import Collection, Sequence
from enum import IntEnum


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


class RandomStalls(ctypes.Structure):
    """struct host_random_stalls."""

    _fields_ = (
        ("seed", ctypes.c_uint64),
        ("sides", ctypes.c_uint32),
        ("gap_ms", ctypes.c_uint32),
        ("longest_ms", ctypes.c_uint32),
    )


def bind(lib: ctypes.CDLL) -> None:
    """Tell ctypes the types of the functions used here."""
    lib.host_stall.argtypes = (ctypes.c_void_p, ctypes.c_int, ctypes.c_uint64, ctypes.c_uint64)
    lib.host_stall.restype = ctypes.c_bool
    lib.host_stall_randomly.argtypes = (ctypes.c_void_p, ctypes.POINTER(RandomStalls))
    lib.host_stall_randomly.restype = None
    lib.host_time_ticks.argtypes = (ctypes.c_void_p,)
    lib.host_time_ticks.restype = ctypes.c_uint64


def stall(lib: ctypes.CDLL, host: int, side: Side, after_s: float, for_s: float, timer_hz: int) -> None:
    """Keep a side from working, from after_s after now on."""
    from_ticks = int(lib.host_time_ticks(host)) + round(after_s * timer_hz)
    assert lib.host_stall(host, side, from_ticks, round(for_s * timer_hz))


def stall_randomly(
    lib: ctypes.CDLL,
    host: int,
    seed: int,
    sides: Collection[Side] = SIDES,
    gap_ms: int = 100,
    longest_ms: int = 50,
) -> None:
    """Stalls from now on, one at a time; an empty `sides` ends them. The same seed gives the same stalls."""
    stalls = RandomStalls(seed, sum(1 << side for side in sides), gap_ms, longest_ms)
    lib.host_stall_randomly(host, ctypes.byref(stalls))


def stall_often(
    lib: ctypes.CDLL, host: int, rng: random.Random, sides: Sequence[Side], timer_hz: int, count: int = 30
) -> None:
    """From now on, with pauses of 20 to 400 ms: one of the sides, or all of them together, for 10 to 800 ms."""
    after_s = rng.uniform(0.0, 0.3)
    for _ in range(count):
        for_s = rng.choice([0.01, 0.03, 0.06, 0.1, 0.3, 0.8])
        for side in sides if rng.random() < 0.5 else [rng.choice(sides)]:
            stall(lib, host, side, after_s, for_s, timer_hz)
        after_s += for_s + rng.uniform(0.02, 0.4)


def seeds(few: int) -> range:
    """Seeds of a test: a few, or as many as WIFICNC_STALL_SEEDS says for a longer look."""
    return range(int(os.environ.get("WIFICNC_STALL_SEEDS", few)))
