"""Keys of a Windows console, which select() cannot wait for: a thread looks for them and wakes the one that waits."""

from __future__ import annotations

import queue
import signal
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

LOOK_EVERY_S = 0.02
SPECIAL = "\x00\xe0"  # comes before the code of an arrow or a function key

if sys.platform == "win32":
    import ctypes
    import msvcrt

    STDOUT_HANDLE, VIRTUAL_TERMINAL = -11, 0x4

    def pressed_key() -> str:
        """The next key; "" when none was pressed, or a special one."""
        if not msvcrt.kbhit():
            return ""
        key = msvcrt.getwch()
        if key in SPECIAL:
            msvcrt.getwch()
            return ""
        return key

    def allow_escapes() -> None:
        """Make the console obey escape sequences, as other terminals do."""
        kernel, mode = ctypes.windll.kernel32, ctypes.c_uint32()
        handle = kernel.GetStdHandle(STDOUT_HANDLE)
        if kernel.GetConsoleMode(handle, ctypes.byref(mode)):
            kernel.SetConsoleMode(handle, mode.value | VIRTUAL_TERMINAL)
else:

    def pressed_key() -> str:
        raise AssertionError("terminals of this system are waited for by select()")

    def allow_escapes() -> None:
        """They do it."""


class Wake:
    """Ends a select() from another thread or a signal's handler, on every system: a pair of sockets."""

    def __init__(self) -> None:
        self._read, self._write = socket.socketpair()
        self._read.setblocking(False)
        self._write.setblocking(False)
        self._before: int | None = None  # what signals wrote to

    def fileno(self) -> int:
        """Can be read after wake()."""
        return self._read.fileno()

    def wake(self) -> None:
        with suppress(OSError):  # full: it was woken already
            self._write.send(b"\0")

    def at_signals(self) -> Wake:
        """Each signal wakes it, too: on Windows none ends a select(). For the main thread, until close()."""
        self._before = signal.set_wakeup_fd(self._write.fileno(), warn_on_full_buffer=False)
        return self

    def drain(self) -> None:
        with suppress(BlockingIOError):
            while self._read.recv(64):
                pass

    def close(self) -> None:
        if self._before is not None:
            signal.set_wakeup_fd(self._before)
        self._read.close()
        self._write.close()


class ConsoleKeys:
    """What is typed at the console. A context manager, for the main thread."""

    def __init__(self, look: Callable[[], str] = pressed_key) -> None:
        self._look = look
        self._keys: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="console keys", daemon=True)

    def __enter__(self) -> ConsoleKeys:
        self._wake = Wake().at_signals()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._wake.close()

    def fileno(self) -> int:
        """For select(): can be read when a key was pressed."""
        return self._wake.fileno()

    def read(self) -> str:
        """Keys since the last call."""
        self._wake.drain()
        return "".join(self._keys.get() for _ in range(self._keys.qsize()))

    def _run(self) -> None:
        while not self._ending.is_set():
            if key := self._look():
                self._keys.put(key)
                self._wake.wake()
            else:
                self._ending.wait(LOOK_EVERY_S)
