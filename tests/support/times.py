"""What each test takes, for `--times FILE`: a line for each, `seconds<TAB>processor seconds<TAB>ring<TAB>test`, with
its fixtures and the processes that it waited for. `python -m suite times FILE` in tools/ adds them up."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def timed(file: Path, ring: str, test: str) -> Iterator[None]:
    """Append to the file; several workers may."""
    begin, used = time.perf_counter(), _used_s()
    yield
    line = f"{time.perf_counter() - begin:.4f}\t{_used_s() - used:.4f}\t{ring}\t{test}\n"
    with file.open("ab", buffering=0) as out:  # one write, so that lines of workers do not mix
        out.write(line.encode())


def _used_s() -> float:
    """Of the processor: this process, and its children that ended."""
    now = os.times()
    return now.user + now.system + now.children_user + now.children_system
