"""A lock between processes, so that two builds of one directory take turns."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

if sys.platform == "win32":
    import msvcrt

    def _lock(fd: int) -> None:
        while True:
            try:
                return msvcrt.locking(fd, msvcrt.LK_LOCK, 1)
            except OSError:  # LK_LOCK gives up after ten seconds
                time.sleep(0.1)
else:
    import fcntl

    def _lock(fd: int) -> None:
        fcntl.flock(fd, fcntl.LOCK_EX)


@contextmanager
def build_lock(directory: Path) -> Iterator[None]:
    """Hold the directory's lock; the system drops it when the process ends, however it ends."""
    directory.mkdir(parents=True, exist_ok=True)
    with open(directory / ".lock", "a+b") as file:
        _lock(file.fileno())
        yield
