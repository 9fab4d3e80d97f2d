"""The monitor of targets/sim/monitor.h: on in every test that drives a machine through the host library."""

from __future__ import annotations

import ctypes
from enum import IntFlag


class Checks(IntFlag):
    """enum monitor_checks."""

    COUNTER = 0x01
    ANSWERS = 0x02
    STATE = 0x04
    LIMITS = 0x08
    BEAM = 0x10
    LIVENESS = 0x20


CHECKS = Checks.COUNTER | Checks.ANSWERS | Checks.STATE | Checks.LIMITS | Checks.BEAM | Checks.LIVENESS


def bind(lib: ctypes.CDLL) -> None:
    """Tell ctypes the types of the functions used here."""
    lib.monitor_create.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
    lib.monitor_create.restype = ctypes.c_void_p
    lib.monitor_destroy.argtypes = (ctypes.c_void_p,)
    lib.monitor_destroy.restype = None
    for name in ("monitor_found", "monitor_end"):
        getattr(lib, name).argtypes = (ctypes.c_void_p,)
        getattr(lib, name).restype = ctypes.c_char_p


class Monitor:
    """Watches one host from its creation to its end."""

    def __init__(self, lib: ctypes.CDLL, host: int, checks: Checks = CHECKS) -> None:
        self._lib = lib
        self._monitor = lib.monitor_create(host, checks)
        assert self._monitor

    def check(self) -> None:
        """Fails when anything was found so far."""
        found: bytes | None = self._lib.monitor_found(self._monitor)
        assert found is None, found.decode("latin-1")

    def close(self) -> None:
        """A reset, after whatever was, leads to a controller that answers. Before the host is destroyed."""
        found: bytes | None = self._lib.monitor_end(self._monitor)
        self._lib.monitor_destroy(self._monitor)
        assert found is None, found.decode("latin-1")
