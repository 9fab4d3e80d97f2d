"""What a test of the ring `core` may not touch (tests/support/rings.py): real waiting, sockets, pseudo-terminals, and
processes but for PROGRAMS. Then no load of the computer can make it fail.

The functions are replaced once, before a test can import them, and refuse while a test of that ring runs.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

REALTIME, CHIPS = "realtime", "chips"

# What a test of that ring may start, by the program's name without a release, and why: all read files, and end.
PROGRAMS = {
    **dict.fromkeys(("cc", "gcc", "clang", "zig", "ziglang"), "the host library and programs of C are compiled"),
    **dict.fromkeys(("ldconfig", "ld", "uname"), "Python looks for a library or its system with it"),
    "git": "the lints read the list of files",
    "sh": "what a shell leaves of the words of a command",
    "rs274": "LinuxCNC's interpreter reads a program, in no time of its own",
}
# And what tests have compiled: in there.
MADE = (Path(__file__).resolve().parents[2] / "build", Path(tempfile.gettempdir()))


class RefusedError(AssertionError):
    """A test does what its ring does not allow."""


class _Guard:
    test = ""  # that runs, of the ring core


def refuse(what: str, ring: str) -> None:
    if _Guard.test and threading.current_thread() is threading.main_thread():
        raise RefusedError(
            f"{what}: no test of the ring core may. {_Guard.test} belongs to the ring {ring} "
            "(tests/support/rings.py), or it waits for virtual time"
        )


@contextmanager
def core_only(test: str) -> Iterator[None]:
    """Refuse while this test runs, with its fixtures."""
    _Guard.test = test
    try:
        yield
    finally:
        allow_again()


def allow_again() -> None:
    _Guard.test = ""


def _refusing(usual: Callable[..., Any], what: str, ring: str) -> Callable[..., Any]:
    def replaced(*args: Any, **named: Any) -> Any:
        refuse(what, ring)
        return usual(*args, **named)

    return replaced


def _sleep(usual: Callable[[float], None]) -> Callable[[float], None]:
    def sleep(seconds: float) -> None:
        if sys._getframe(1).f_globals.get("__name__") != "subprocess":  # it waits for one of PROGRAMS
            refuse("sleeping", REALTIME)
        usual(seconds)

    return sleep


def _wait(usual: Callable[..., bool]) -> Callable[..., bool]:
    def wait(self: threading.Condition, timeout: float | None = None) -> bool:
        if timeout is not None and timeout > 0:
            refuse("waiting for a thread until a clock says so", REALTIME)
        return usual(self, timeout)

    return wait


def _start(usual: Callable[..., None]) -> Callable[..., None]:
    def start(self: Any, args: Any, *more: Any, **named: Any) -> None:
        words = [args] if isinstance(args, (str, bytes, os.PathLike)) else list(args)
        if not _is_program(list(map(os.fsdecode, words))):
            refuse(f"starting {' '.join(map(os.fsdecode, words))[:120]}", CHIPS)
        usual(self, args, *more, **named)

    return start


def _is_program(words: list[str]) -> bool:
    """One of PROGRAMS, `python -m` one of them, or one of C."""
    name = words[2] if words[1:2] == ["-m"] and len(words) > 2 else Path(words[0]).name
    program = Path(words[0])
    if any(program.is_relative_to(folder) for folder in MADE) and not program.is_relative_to(sys.prefix):
        return True
    return name.removesuffix(".exe").partition("-")[0] in PROGRAMS


def install() -> None:
    """Once in a process, before tests are imported."""
    time.sleep = _sleep(time.sleep)
    threading.Condition.wait = _wait(threading.Condition.wait)
    subprocess.Popen.__init__ = _start(subprocess.Popen.__init__)
    socket.socket.__init__ = _refusing(socket.socket.__init__, "a socket", REALTIME)
    for name, ring in (("openpty", REALTIME), ("fork", CHIPS), ("system", CHIPS)):
        if hasattr(os, name):
            setattr(os, name, _refusing(getattr(os, name), f"os.{name}", ring))
