"""Shared libraries of C under test, with the prototypes that the headers declare."""

from __future__ import annotations

import ctypes
from functools import cached_property
from pathlib import Path
from typing import Any

from layouts import HOST, Layouts
from wificnc.build.host import ensure_host_library


def load(path: Path, layouts: Layouts) -> ctypes.CDLL:
    """The library, each of whose functions checks what it is called with, where a header declares it."""
    library = ctypes.CDLL(str(path))
    for name in layouts.functions():
        function = getattr(library, name, None)
        if function is not None:
            function.restype, function.argtypes = layouts.prototype(name)
    return library


class HostLibrary:
    """The functions of the host library, which is built and loaded when the first one is called."""

    @cached_property
    def _loaded(self) -> ctypes.CDLL:
        return load(ensure_host_library(), HOST)

    def __getattr__(self, name: str) -> Any:
        function = getattr(self._loaded, name)
        setattr(self, name, function)  # the next call finds it without us
        return function


LIB = HostLibrary()
CONSUMER = HOST.prototype("trace_add")[1][1]
EVENT = HOST.record("trace_event", t_ticks="t", step_mask="step", dir_mask="dir")
