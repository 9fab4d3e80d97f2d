"""The monitor of targets/sim/monitor.h: on in every test that drives a machine through the host library."""

from __future__ import annotations

from enum import IntFlag

from c_library import HostLibrary


class Checks(IntFlag):
    """enum monitor_checks."""

    COUNTER = 0x01
    ANSWERS = 0x02
    STATE = 0x04
    LIMITS = 0x08
    BEAM = 0x10
    LIVENESS = 0x20
    STOPS = 0x40


CHECKS = ~Checks(0)


class Monitor:
    """Watches one host from its creation to its end."""

    def __init__(self, lib: HostLibrary, host: int, checks: Checks = CHECKS) -> None:
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
