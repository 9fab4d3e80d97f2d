"""The real core behind a loopback TCP port, for tests of senders: counts bytes under way, does harm on request.

Virtual time: the controller is as fast as this computer. slow_after() lets a job last until the sender says something.
"""

from __future__ import annotations

import contextlib
import ctypes
import select
import socket
import threading
from collections import deque
from collections.abc import Callable
from types import TracebackType

from c_library import LIB
from monitor import Monitor
from patience import HANG_S
from wificnc.simulator.library import HostBoard

AXES = 6
EVENTS_PER_ROUND = 20_000
REALTIME = frozenset(b"!~?\x18") | frozenset(range(0x80, 0x100))
FAST = "$110=20000\n$111=20000\n$112=20000\n$120=2000\n$121=2000\n$122=2000\n"


class Bridge:
    """One controller on one port, one client after the other. A context manager."""

    def __init__(self, axes: int = 3, settings: str = FAST, said: dict[str, str] | None = None) -> None:
        self._lib = LIB
        board = HostBoard(20_000_000, 1000, 500, 500_000, axes)
        self._host = self._lib.host_create(ctypes.byref(board))
        assert self._host
        self._monitor = Monitor(self._lib, self._host)
        self._said = said or {}  # lines that the bridge answers in the controller's place
        self._server = socket.create_server(("127.0.0.1", 0))
        self._connection: socket.socket | None = None
        self._pending = bytearray()
        self._line = bytearray()
        self._half_answer = b""
        self._under_way: deque[int] = deque()
        self._hooks: dict[int, Callable[[], None]] = {}
        self._slow_after: int | None = None
        self._reset_at: tuple[int, int] | None = None
        self._stop = threading.Event()
        self.lock = threading.Condition()
        self.lines: list[str] = []
        self.answers: list[str] = []
        self.most_bytes = 0
        self.overruns = 0
        self._command(settings)
        self._thread = threading.Thread(target=self._serve, name="bridge", daemon=True)

    @property
    def target(self) -> str:
        return f"tcp://127.0.0.1:{self._server.getsockname()[1]}"

    def __enter__(self) -> Bridge:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, tb: TracebackType | None) -> None:
        self._stop.set()
        self._thread.join(HANG_S)
        assert not self._thread.is_alive()
        self._drop()
        self._server.close()
        try:
            self._monitor.close()
        finally:
            self._lib.host_destroy(self._host)

    # ---- the machine ----

    def surface(self, z_steps: int) -> None:
        """The probe touches at and below this Z. Before the first client."""
        self._lib.virtual_surface(self._host, z_steps)

    def travel(self, axis: int, low_steps: int, high_steps: int) -> None:
        """Limit switches. Before the first client."""
        self._lib.virtual_travel(self._host, axis, low_steps, high_steps)

    # ---- harm ----

    def at_answer(self, count: int, action: Callable[[], None]) -> None:
        """Do this in the bridge's thread once so many lines were answered since begin_count()."""
        self._hooks[count] = action

    def slow_after(self, count: int) -> None:
        """Once so many lines were answered, let almost no time pass until a hold or a reset comes."""
        self._slow_after = count

    def reset_while_lines_wait(self, answered: int, waiting: int) -> None:
        """Reset as soon as so many lines were answered and so many more were taken and not."""
        self._reset_at = (answered, waiting)

    def begin_count(self) -> None:
        with self.lock:
            self.lines.clear()
            self.answers.clear()
            self.most_bytes = 0

    def reset(self) -> None:
        """As if someone pressed the controller's reset."""
        self._pending[:0] = b"\x18"

    def drop(self) -> None:
        """The link breaks."""
        self._drop()

    def wait_answers(self, count: int, cap_s: float = HANG_S) -> None:
        with self.lock:
            assert self.lock.wait_for(lambda: len(self.answers) >= count, cap_s), self.answers[-5:]

    def position_steps(self) -> list[int]:
        steps = (ctypes.c_int32 * AXES)()
        self._lib.host_position_steps(self._host, steps)
        return list(steps)

    # ---- work ----

    def _command(self, text: str) -> None:
        self._lib.host_input_follows(self._host, 0)
        for line in text.splitlines():
            data = line.encode() + b"\n"
            assert self._lib.host_write(self._host, data, len(data)) == len(data)
            self._lib.host_run(self._host, 1_000_000)
        assert b"error" not in self._read()

    def _read(self) -> bytes:
        buffer = ctypes.create_string_buffer(65536)
        said = b""
        while count := self._lib.host_read(self._host, buffer, len(buffer)):
            said += buffer.raw[:count]
        return said

    def _serve(self) -> None:
        moving = False
        while not self._stop.is_set():
            sockets = [self._server] if self._connection is None else [self._connection]
            ready, _, _ = select.select(sockets, [], [], 0 if moving or self._pending else 0.02)
            if self._server in ready:
                self._connection, _ = self._server.accept()
                self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            elif ready:
                self._receive()
            moving = self._work()

    def _receive(self) -> None:
        assert self._connection
        try:
            data = self._connection.recv(65536)
        except OSError:
            data = b""
        if not data:
            self._drop()
        self._pending += data

    def _drop(self) -> None:
        if self._connection:
            self._connection.close()
            self._connection = None

    def _work(self) -> bool:
        """Hand bytes over and let time pass. @return whether something moves"""
        if b"!" in self._pending or b"\x18" in self._pending:
            self._slow_after = None
        taken = self._take_pending()
        slow = self._slow_after is not None and len(self.answers) >= self._slow_after
        wait = self._lib.host_run(self._host, 1 if slow else EVENTS_PER_ROUND)
        self._hear(self._read())
        if self._reset_at and len(self.answers) >= self._reset_at[0] and len(self._under_way) >= self._reset_at[1]:
            self._reset_at = None
            self.reset()
        return bool(taken) or wait == 2

    def _take_pending(self) -> int:
        """Real-time bytes immediately, the others as far as the controller takes them."""
        taken = 0
        for byte in bytes(self._pending):
            if byte == 0x18:
                self._under_way.clear()
                self._line.clear()
            if byte in REALTIME:
                assert self._lib.host_write(self._host, bytes([byte]), 1) == 1
            elif not self._put(byte):
                self.overruns += 1
                break
            taken += 1
        del self._pending[:taken]
        self.most_bytes = max(self.most_bytes, sum(self._under_way) + len(self._line))
        return taken

    def _put(self, byte: int) -> bool:
        if byte != ord("\n"):
            self._line.append(byte)
            return True
        text = self._line.decode("latin-1")
        if text in self._said:
            assert not self._under_way
            self._send(self._said[text].encode() + b"ok\r\n")
        else:
            data = bytes(self._line) + b"\n"
            if self._lib.host_write(self._host, data, len(data)) != len(data):
                return False
            self._under_way.append(len(data))
            with self.lock:
                self.lines.append(text)
        self._line.clear()
        return True

    def _hear(self, said: bytes) -> None:
        *whole, self._half_answer = (self._half_answer + said).split(b"\n")
        for line in whole:
            text = line.strip().decode()
            self._send(line + b"\n")
            if text != "ok" and not text.startswith("error:"):
                continue
            if self._under_way:
                self._under_way.popleft()
            with self.lock:
                self.answers.append(text)
                self.lock.notify_all()
            if action := self._hooks.pop(len(self.answers), None):
                action()

    def _send(self, data: bytes) -> None:
        if self._connection:
            with contextlib.suppress(OSError):
                self._connection.sendall(data)
