"""Byte streams to a controller: TCP and serial ports."""

from __future__ import annotations

import errno
import os
import select
import socket
import sys
import time
from collections.abc import Sequence
from typing import Protocol

import serial

from wificnc.connection.access import KEY_VARIABLE, login_proof
from wificnc.connection.port import BOARD_PORT, SERVE_PORT
from wificnc.connection.target import NetworkTarget, is_this_computer, parse_target
from wificnc.errors import LinkError, RefusedError

CONNECT_TIMEOUT_S = 5.0
SEND_TIMEOUT_S = 5.0
LOGIN_S = 25.0  # a login waits for its turn behind those of other connections, 4 s each (core/base/lockout.h)
CHUNK = 65536
SLICE_S = 0.01  # between two looks, where the system cannot wait for a serial port


class Transport(Protocol):
    """A byte stream both ways. Every method raises LinkError once the other side is gone."""

    name: str

    def receive(self) -> bytes:
        """What has come; b"" when nothing has. Never waits."""

    def send(self, data: bytes) -> None:
        """All of it. Waits while the other side takes no bytes, but not for ever."""

    def wait(self, timeout_s: float, others: Sequence[int] = ()) -> None:
        """Until something can be received, one of the other file descriptors can be read, or time is up."""

    def close(self) -> None:
        """Twice does no harm."""


class SocketTransport:
    """A connected socket. socket_pair() gives one with its other end in the same process."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        connection.setblocking(False)
        self.name = name
        self._socket = connection
        self._ahead = b""  # was received while something else was waited for

    def receive(self) -> bytes:
        if self._ahead:
            ahead, self._ahead = self._ahead, b""
            return ahead
        try:
            data = self._socket.recv(CHUNK)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError as err:
            raise _lost(self.name, err) from err
        if not data:
            raise LinkError(f"{self.name} closed the connection")
        return data

    def send(self, data: bytes) -> None:
        deadline = time.monotonic() + SEND_TIMEOUT_S
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[self._socket.send(rest) :]
            except (BlockingIOError, InterruptedError):
                self._wait_writable(deadline)
            except OSError as err:
                raise _lost(self.name, err) from err

    def _wait_writable(self, deadline: float) -> None:
        left_s = deadline - time.monotonic()
        if left_s <= 0 or not select.select([], [self._socket], [], left_s)[1]:
            raise LinkError(f"{self.name} has accepted no data for {SEND_TIMEOUT_S:.0f} s")

    def wait(self, timeout_s: float, others: Sequence[int] = ()) -> None:
        if not self._ahead:
            select.select([self._socket.fileno(), *others], [], [], max(0.0, timeout_s))

    def log_in(self, key: str) -> None:
        """Log in to a controller with its access key, which is proven and not sent.

        Raises:
            RefusedError: it is wrong.
            LinkError: no answer.
        """
        said = self._ask(b"$LOGIN\n")
        proof = login_proof(key, said)
        if proof is not None:
            said = self._ask(b"$LOGIN=" + proof + b"\n")
        if b"rong access key" in said:
            hint = (
                f"the key is after the : of --to, or in the variable {KEY_VARIABLE}, which may be another controller's"
            )
            raise RefusedError(f"{self.name} refuses the access key", hint)
        self._ahead = said.partition(b"ok\r\n")[2]

    def _ask(self, line: bytes) -> bytes:
        """What comes up to the answer to this line of a login."""
        self.send(line)
        deadline, said = time.monotonic() + LOGIN_S, b""
        while not any(word in said for word in (b"ok\r\n", b"error:", b"rong access key")):
            left_s = deadline - time.monotonic()
            if left_s <= 0:
                raise LinkError(f"{self.name} does not answer the login")
            self.wait(left_s)
            said += self.receive()
        return said

    def close(self) -> None:
        self._socket.close()


class SerialTransport:
    """A serial port, or a pseudo-terminal that looks like one."""

    def __init__(self, path: str, baud: int) -> None:
        self.name = f"serial://{path}"
        exclusive = None if sys.platform == "win32" else True
        try:
            self._port = serial.Serial(path, baud, timeout=0, write_timeout=SEND_TIMEOUT_S, exclusive=exclusive)
        except (serial.SerialException, ValueError, OSError) as err:
            raise _cannot_open(path, err) from err

    def receive(self) -> bytes:
        try:
            return bytes(self._port.read(CHUNK))
        except (serial.SerialException, OSError, TypeError) as err:  # TypeError: pyserial, closed under its feet
            raise _lost(self.name, err) from err

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except serial.SerialTimeoutException as err:
            raise LinkError(f"{self.name} has accepted no data for {SEND_TIMEOUT_S:.0f} s") from err
        except (serial.SerialException, OSError, TypeError) as err:
            raise _lost(self.name, err) from err

    def wait(self, timeout_s: float, others: Sequence[int] = ()) -> None:
        if sys.platform != "win32":
            select.select([self._port.fileno(), *others], [], [], max(0.0, timeout_s))
            return
        deadline = time.monotonic() + timeout_s
        while self._port.in_waiting == 0 and time.monotonic() < deadline:
            if others and select.select(others, [], [], SLICE_S)[0]:
                return
            if not others:
                time.sleep(SLICE_S)

    def close(self) -> None:
        self._port.close()


def socket_pair(name: str = "fake") -> tuple[SocketTransport, socket.socket]:
    """A transport and the controller's end of it, in one process."""
    ours, theirs = socket.socketpair()
    return SocketTransport(ours, name), theirs


def open_transport(text: str) -> SocketTransport | SerialTransport:
    """Open a target.

    Raises:
        UserError: it is not written as one.
        LinkError: nothing answers there.
    """
    target = parse_target(text)
    if isinstance(target, NetworkTarget):
        return _open_tcp(target)
    return SerialTransport(target.path, target.baud)


def _open_tcp(target: NetworkTarget) -> SocketTransport:
    host = f"[{target.host}]" if ":" in target.host else target.host
    name = f"tcp://{host}:{target.port}"
    try:
        connection = socket.create_connection((target.host, target.port), CONNECT_TIMEOUT_S)
    except OSError as err:
        raise LinkError(f"cannot reach {name}: {err.strerror or err}", _where_to_look(target, host, err)) from err
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    transport = SocketTransport(connection, name)
    if key := target.key or os.environ.get(KEY_VARIABLE, ""):
        try:
            transport.log_in(key)
        except BaseException:
            transport.close()
            raise
    return transport


def _where_to_look(target: NetworkTarget, host: str, err: OSError) -> str:
    if is_this_computer(target.host):
        return "`wificnc serve` simulates a controller on this computer"
    if isinstance(err, socket.gaierror):
        return "check the name; `wificnc discover` lists the controllers of this network"
    if not isinstance(err, ConnectionRefusedError):
        return "check that the controller is on and on this network; `wificnc discover` searches for it"
    if target.port == BOARD_PORT:
        return f"no controller listens at this port; `wificnc serve` on that computer listens at {host}:{SERVE_PORT}"
    return f"no controller listens at this port; a board listens at {host}:{BOARD_PORT}"


def _lost(name: str, err: Exception) -> LinkError:
    reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
    return LinkError(f"the link to {name} is lost: {reason}")


def _cannot_open(path: str, err: Exception) -> LinkError:
    number = getattr(err, "errno", None)
    hints = {
        errno.ENOENT: "check that it is connected; `ls /dev/serial/by-id` lists serial devices",
        errno.EACCES: "no permission: join its group (`sudo usermod -aG dialout $USER`), then log in again",
        errno.EWOULDBLOCK: "another program uses it (a sender, a monitor?)",
        errno.EBUSY: "another program uses it (a sender, a monitor?)",
    }
    reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
    return LinkError(f"cannot open {path}: {reason}", hint=hints.get(number) if number else None)
