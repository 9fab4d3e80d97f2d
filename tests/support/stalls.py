"""Stalls and task periods of a host controller (targets/host/host.h): what tests of any folder need of them."""

from __future__ import annotations

import ctypes
from collections.abc import Collection
from enum import IntEnum


class Side(IntEnum):
    """enum host_side: what can be kept from working."""

    CONTROLLER = 0
    MOTION = 1
    READER = 2


SIDES = tuple(Side)


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
