"""Single keys and signals while a job runs. The terminal is given back as it was, however the job ends."""

from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Sequence
from types import FrameType, TracebackType
from typing import Any

from wificnc.console import ConsoleKeys, Wake
from wificnc.job.run import CTRL_C, TERMINATED

if sys.platform != "win32":
    import termios

    def _single_keys(fd: int) -> None:
        """Keys come immediately and are not shown. Ctrl-C stays a signal; Ctrl-Z does nothing: a job runs."""
        mode = termios.tcgetattr(fd)
        mode[3] &= ~(termios.ICANON | termios.ECHO)
        mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
        mode[6][termios.VSUSP] = b"\0"
        termios.tcsetattr(fd, termios.TCSANOW, mode)


class Keyboard:
    """Keys from a terminal, when stdin is one, and Ctrl-C, SIGTERM and SIGHUP as keys.

    SIGHUP and SIGINT stay ignored when they are at the start: `nohup wificnc send` outlives its terminal.

    A context manager, for the main thread.
    """

    def __init__(self) -> None:
        self.interactive = sys.stdin.isatty()
        self._console: ConsoleKeys | None = None  # of Windows
        self._pressed = ""
        self._saved_terminal: list[Any] | None = None
        self._saved_handlers: dict[int, Any] = {}

    def __enter__(self) -> Keyboard:
        self._wake = Wake()
        for name, key in (("SIGINT", CTRL_C), ("SIGTERM", TERMINATED), ("SIGHUP", TERMINATED)):
            number = getattr(signal, name, None)
            if number is not None and (name == "SIGTERM" or signal.getsignal(number) is not signal.SIG_IGN):
                self._saved_handlers[number] = signal.signal(number, self._handler(key))
        if not self.interactive:
            return self
        if sys.platform == "win32":
            self._console = ConsoleKeys().__enter__()
        else:
            self._saved_terminal = termios.tcgetattr(sys.stdin)
            _single_keys(sys.stdin.fileno())
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, tb: TracebackType | None) -> None:
        if self._console is not None:
            self._console.__exit__()
        if sys.platform != "win32" and self._saved_terminal is not None:
            termios.tcsetattr(sys.stdin, termios.TCSANOW, self._saved_terminal)
        for number, handler in self._saved_handlers.items():
            signal.signal(number, handler)
        self._wake.close()

    def _handler(self, key: str) -> Any:
        def pressed(number: int, frame: FrameType | None) -> None:
            self._pressed += key
            self._wake.wake()

        return pressed

    def fds(self) -> Sequence[int]:
        typed = [self._console or sys.stdin] if self.interactive else []
        return [self._wake.fileno(), *(source.fileno() for source in typed)]

    def read(self) -> str:
        """Keys since the last call. A terminal that went away is a request to end."""
        self._wake.drain()
        keys, self._pressed = self._pressed, ""
        if self._console is not None:
            return keys + self._console.read()
        if self.interactive and select.select([sys.stdin], [], [], 0)[0]:
            try:
                typed = os.read(sys.stdin.fileno(), 256)
            except OSError:
                typed = b""
            self.interactive = bool(typed)
            keys += typed.decode("latin-1") or TERMINATED
        return keys
