"""`wificnc serve` of a board's real image in the virtual chip, at the speed of a clock.

The chip has one serial port. Whoever connects, by TCP or at the pseudo-terminal, is at that wire: all clients hear all
answers, and what they write is mixed byte by byte, as it would be. An image with Ethernet has its own servers behind
ports of this computer (ethernet.py); then only the pseudo-terminal is at the wire. Time that the computer cannot keep
up with is skipped, not made up for.
"""

from __future__ import annotations

import errno
import os
import selectors
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from wificnc.errors import ServeError
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import ClientEvent, no_pty
from wificnc.simulator.serve.store_file import claim_store

from wificnc_chips.control import Control, ControlClient
from wificnc_chips.esp32.machine import EspMachine
from wificnc_chips.ethernet import OFF, USER, Ethernet, network_kind
from wificnc_chips.wired import access_key, greet, load_settings, save_settings, wire

SLICE_S = 0.001  # of the chip's time between two looks at the clients
BEHIND_S = 0.1  # more than this behind the clock is given up
ANSWER_S = 1.0
READ_SIZE = 4096
MAX_WAITING = 1 << 20  # bytes for a client that does not read; then it is let go

if sys.platform == "win32":

    def _open_terminal(link: Path) -> tuple[int, int, Path]:
        raise ServeError(f"--pty {link}: {no_pty()}")
else:
    import tty

    def _open_terminal(link: Path) -> tuple[int, int, Path]:
        """Our end of a pseudo-terminal, the client's, and the name of that."""
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        return ours, theirs, Path(os.ttyname(theirs))


@dataclass
class Door:
    """One end of the wire: a connection, or the pseudo-terminal."""

    who: str
    read: Callable[[], bytes | None]  # None: it is gone
    write: Callable[[bytes], int]
    close: Callable[[], None]
    waiting: bytes = b""
    stays: bool = False  # the pseudo-terminal is there when no one is
    hears: bool = True  # the control port has its own answers


LetIn = Callable[[socket.socket], Iterator[ClientEvent]]


class ChipServer:
    """A controller that serves from `with` until it ends.

    Raises:
        ServeError: on entry, when a door cannot be opened or a setting is refused.
    """

    def __init__(self, options: ServeOptions) -> None:
        self.options = options
        self.network = network_kind(options)
        self.tcp: str | None = None
        self.page: str | None = None  # of the image's own web server
        self.key: str | None = None  # of its network clients
        self.control: str | None = None
        self.wmc3: str | None = None
        self.device: Path | None = None
        self._ethernet: Ethernet | None = None
        self._fresh: list[bytes] = []  # said at a power-on
        self._selector = selectors.DefaultSelector()
        self._listeners: list[socket.socket] = []
        self._doors: list[Door] = []
        self._claim: int | None = None
        self._greeting = ""
        self._loaded = False  # a file that could not be read is not written either

    def __enter__(self) -> ChipServer:
        self._chip = wire(self.options.board, self.options.image)
        try:
            if self.options.store:
                self._claim = claim_store(self.options.store)
            load_settings(self._chip, self.options.store)
            self._loaded = True
            self._start()
            for line in self.options.settings:
                self._set(line)
            if self.options.settings:  # they are stored: with $22=1 it starts locked
                self._start()
            self._open_network()
            if self.network != USER:
                self.tcp = self._listen(self.options.tcp, "--tcp", self._let_in)
            self._open_pty(self.options.pty)
            self._open_control()
        except BaseException:
            self.stop()
            raise
        return self

    def _start(self) -> None:
        self._chip.power_on()
        self._greeting = greet(self._chip)

    def power(self) -> None:
        """Off and on again; what it says is for the clients. Raises ChipFault."""
        self._chip.power_on()
        self._fresh.append(greet(self._chip).encode("latin-1"))

    def plug(self, up: bool) -> bool:
        """The cable. @return whether there is one"""
        if self._ethernet is not None:
            self._ethernet.plug(up)
        return self._ethernet is not None

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> int:
        """Close all doors and keep what is stored; its exit code."""
        if self._loaded and self.options.store:
            save_settings(self._chip, self.options.store)
        self._loaded = False
        if self._claim is not None:
            os.close(self._claim)
            self._claim = None
        for door in self._doors:
            door.close()
        self._doors = []
        for listener in self._listeners:
            listener.close()
        if self._ethernet is not None:
            self._ethernet.close()
            self._ethernet = None
        if self.device and self.options.pty:
            with suppress(OSError):
                self.options.pty.unlink()
        self._selector.close()
        self._chip.close()
        return 0

    def events(self) -> Iterator[ClientEvent]:
        """Serve; what happens to the clients, as it happens. Raises ChipFault."""
        begin, zero = time.monotonic(), self._chip.cycles
        self._fresh.append(self._greeting.encode("latin-1"))
        while True:
            yield from self._look_at_clients()
            due = zero + int((time.monotonic() - begin) * self.options.speed * self._chip.cpu_hz)
            step = round(SLICE_S * self._chip.cpu_hz)
            if self.options.speed == 0:
                due = self._chip.cycles + step
            elif due - self._chip.cycles > BEHIND_S * self._chip.cpu_hz:
                zero += due - self._chip.cycles - step
                due = self._chip.cycles + step
            while due > self._chip.cycles:
                self._chip.run_until(min(due, self._chip.cycles + step) if self._ethernet else due)
                if self._ethernet is not None:
                    self._ethernet.carry()
            said = b"".join(self._fresh) + self._chip.read()
            self._fresh.clear()
            yield from self._news(said)
            yield from self._say(said)

    def _news(self, said: bytes) -> Iterator[ClientEvent]:
        """The network address that the image has got."""
        address = self._ethernet.hear(said) if self._ethernet and said else None
        if address is not None:
            yield ClientEvent("is the image's address", address)

    # ---- clients ----

    def _look_at_clients(self) -> Iterator[ClientEvent]:
        for key, _ in self._selector.select(SLICE_S if self.options.speed else 0):
            if not isinstance(key.data, Door):
                yield from key.data(key.fileobj)
                continue
            data = key.data.read()
            if data:
                self._chip.write(data)
            elif data is None and not key.data.stays:
                yield from self._let_go(key.data)

    def _say(self, said: bytes) -> Iterator[ClientEvent]:
        for door in list(self._doors):
            door.waiting += said if door.hears else b""
            if not door.waiting:
                continue
            try:
                door.waiting = door.waiting[door.write(door.waiting) :]
            except BlockingIOError:
                pass
            except OSError:
                door.waiting = b""
                if not door.stays:
                    yield from self._let_go(door)
                    continue
            if door.stays:
                door.waiting = door.waiting[-READ_SIZE:]  # no one reads there now
            elif len(door.waiting) > MAX_WAITING:
                yield from self._let_go(door)

    def _let_in(self, listener: socket.socket) -> Iterator[ClientEvent]:
        client, peer = listener.accept()
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        who = f"{peer[0]}:{peer[1]}"
        self._add(client, Door(who, lambda: _receive(client), client.send, client.close))
        yield ClientEvent("connected", who)

    def _let_control_in(self, listener: socket.socket) -> Iterator[ClientEvent]:
        client, peer = listener.accept()
        client.setblocking(False)
        hands = ControlClient(client, Control(self._chip, self.options.board, self).obey)
        self._add(client, Door(f"control {peer[1]}", hands.read, client.send, client.close, hears=False))
        yield from ()

    def _add(self, client: socket.socket, door: Door) -> None:
        self._doors.append(door)
        self._selector.register(client, selectors.EVENT_READ, door)

    def _let_go(self, door: Door) -> Iterator[ClientEvent]:
        for key in list(self._selector.get_map().values()):
            if key.data is door:
                self._selector.unregister(key.fileobj)
        self._doors.remove(door)
        door.close()
        if door.hears:
            yield ClientEvent("disconnected", door.who)

    # ---- start ----

    def _open_network(self) -> None:
        if self.network == OFF:
            return
        assert isinstance(self._chip, EspMachine)
        self._ethernet = Ethernet(self._chip, self.network, self.options)
        self.tcp, self.page, self.wmc3 = self._ethernet.tcp, self._ethernet.page, self._ethernet.wmc3
        self.key = access_key(self._chip)

    def _open_control(self) -> None:
        if self.options.control is not None:
            at = Address("127.0.0.1", self.options.control)
            self.control = self._listen(at, "--control", self._let_control_in)

    def _listen(self, address: Address | None, option: str, let_in: LetIn) -> str | None:
        """@return where it listens"""
        if address is None:
            return None
        try:
            family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
            listener = socket.create_server((address.host, address.port), family=family)
        except OSError as err:
            why = err.strerror or str(err)
            free = "127.0.0.1:0" if option == "--tcp" else "0"
            raise ServeError(f"cannot listen at {address}: {why}", hint=f"{option} {free} takes any free one") from err
        listener.setblocking(False)
        self._listeners.append(listener)
        self._selector.register(listener, selectors.EVENT_READ, let_in)
        return str(Address(address.host, listener.getsockname()[1]))

    def _open_pty(self, link: Path | None) -> None:
        if link is None:
            return
        ours, theirs, self.device = _open_terminal(link)
        door = Door(str(link), lambda: _read(ours), lambda data: os.write(ours, data), lambda: _close(ours, theirs))
        door.stays = True
        self._doors.append(door)
        self._selector.register(ours, selectors.EVENT_READ, door)
        try:
            link.symlink_to(self.device)
        except OSError as err:
            self.device = None
            what = "the name is already in use" if err.errno == errno.EEXIST else os.strerror(err.errno or 0)
            raise ServeError(f"--pty {link}: {what}", hint="choose another name") from err

    def _set(self, line: str) -> None:
        """Type a setting at the serial port, as a sender would. Raises ServeError."""
        self._chip.read()
        self._chip.write(line.encode() + b"\n")
        said = b""
        for _ in range(round(ANSWER_S / SLICE_S)):
            self._chip.run(SLICE_S)
            said += self._chip.read()
            if b"ok\r\n" in said:
                return
            if b"error:" in said and said.endswith(b"\r\n"):
                break
        raise ServeError(f"the controller refuses {line}: {said.decode('ascii', 'replace').strip() or 'no answer'}")


def _receive(client: socket.socket) -> bytes | None:
    try:
        return client.recv(READ_SIZE) or None
    except BlockingIOError:
        return b""
    except OSError:
        return None


def _read(descriptor: int) -> bytes | None:
    try:
        return os.read(descriptor, READ_SIZE)
    except OSError:
        return None


def _close(*descriptors: int) -> None:
    for descriptor in descriptors:
        os.close(descriptor)
