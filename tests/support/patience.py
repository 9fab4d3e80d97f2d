"""Waits of tests. What is awaited comes, however late a busy computer is; a cap is only there so that a hang ends."""

from __future__ import annotations

import time
from collections.abc import Callable

HANG_S = 120.0  # nothing that is awaited takes this long, at any load: it hangs
BUILD_S = 10 * HANG_S  # the same of programs that compile or install: half a minute on a quiet computer
LOOK_S = 0.005


def wait_until(holds: Callable[[], bool], what: object, cap_s: float = HANG_S) -> None:
    """Look again and again. @param what  that does not come; a function is called for it"""
    end = time.monotonic() + cap_s
    while not holds():
        assert time.monotonic() < end, f"does not come: {what() if callable(what) else what}"
        time.sleep(LOOK_S)
