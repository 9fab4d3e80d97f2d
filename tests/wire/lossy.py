"""A bad network between hosts of the binary protocol and a device, over real sockets of this computer."""

from __future__ import annotations

import contextlib
import heapq
import itertools
import random
import selectors
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType

from patience import HANG_S
from wificnc.connection.wmc3.layout import CONTROL_PORT, IO_STATUS_PORT, STATUS_PORT, UDP_PORT

DATAGRAM_MAX = 2048
Peer = tuple[str, int]


@dataclass
class Counts:
    """What one direction did to its datagrams."""

    came: int = 0
    lost: int = 0
    doubled: int = 0
    delivered: int = 0  # with the doubles
    overtaken: int = 0  # delivered behind one that had come later

    @property
    def on_way(self) -> int:
        """Copies that have come and are not delivered."""
        return self.came - self.lost + self.doubled - self.delivered


@dataclass
class Way:
    """One direction: the fates of its datagrams, and how many had which."""

    random: random.Random
    counts: Counts = field(default_factory=Counts)
    newest: int = -1


class Lossy:
    """Hosts talk to `address` as if it were the device; what they say gets to `device`, and its answers to them, badly.

        with Server(ServeOptions(wmc3="127.1.2.3", ...)), \\
                Lossy(device="127.1.2.3", address="127.1.2.4", loss=0.3, duplicate=0.3, delay_ms=(0, 20)) as network:
            ...                       # any host program, told that its device is at 127.1.2.4
            network.loss = 1.0        # the network is gone
            network.to_device.lost    # counted so far; so is network.to_host

    Every datagram (motion, commands, acks, status) is lost with the probability `loss`; of the others one is sent twice
    with `duplicate`; and each copy takes its own time, evenly between the two of `delay_ms`, so they overtake one
    another. All three may be changed while it runs. Each direction has a generator of its own made from `seed`: the
    n-th datagram of a direction has the same fate in every run. TCP is passed through unharmed.

    All ports are the protocol's. Status comes to the hosts' ports 58428 and 58430 from `address` port 58427, so hosts
    may connect() to it. For the device all hosts are one, at the address `local`, which is the device's own if not
    said: host programs on this computer that speak to the device directly do it from there, and cannot hear its status
    meanwhile. `address` and `local` must be addresses of this computer, as all of 127.0.0.0/8 are on Linux; elsewhere
    entering it raises OSError. `delivered` has the datagrams that the device got, in their order.
    """

    def __init__(
        self,
        device: str,
        address: str,
        loss: float = 0.0,
        duplicate: float = 0.0,
        delay_ms: tuple[float, float] = (0.0, 0.0),
        seed: int = 1,
        local: str = "",
    ) -> None:
        self.device, self.address, self.local = device, address, local or device
        self.loss, self.duplicate, self.delay_ms = loss, duplicate, delay_ms
        self.delivered: list[bytes] = []
        self._to_device = Way(random.Random(f"{seed} to device"))
        self._to_host = Way(random.Random(f"{seed} to host"))
        self._on_way: list[tuple[float, int, int, Way, Callable[[bytes], None], bytes]] = []
        self._serial = itertools.count()
        self._links: dict[Peer, socket.socket] = {}  # for each host's port one of our own, so that acks find back
        self._sockets: list[socket.socket] = []
        self._selector = selectors.DefaultSelector()
        self._threads: list[threading.Thread] = []
        self._ends = False

    @property
    def to_device(self) -> Counts:
        return self._to_device.counts

    @property
    def to_host(self) -> Counts:
        return self._to_host.counts

    def __enter__(self) -> Lossy:
        try:
            self._front = self._udp(self.address, UDP_PORT)
            self._watch(self._front, self._from_host)
            for port in (STATUS_PORT, IO_STATUS_PORT):
                status = self._udp(self.local, port)
                status.connect((self.device, UDP_PORT))
                self._watch(status, lambda status=status, port=port: self._status(status, port))
            listener = self._keep(socket.create_server((self.address, CONTROL_PORT)))
        except OSError:
            self._close()
            raise
        self._start(self._accept, listener)
        self._start(self._run)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends = True
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as waker:
            waker.sendto(b"", (self.address, UDP_PORT))
        self._close()

    def _close(self) -> None:
        for each in self._sockets:  # who waits in one of them wakes up
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(HANG_S)
        for each in self._sockets:
            each.close()
        self._selector.close()

    def _start(self, work: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _keep(self, each: socket.socket) -> socket.socket:
        self._sockets.append(each)
        return each

    # ---- UDP ----

    def _udp(self, address: str, port: int) -> socket.socket:
        each = self._keep(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        each.setblocking(False)
        if port:
            each.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        each.bind((address, port))
        return each

    def _watch(self, each: socket.socket, arrived: Callable[[], None]) -> None:
        self._selector.register(each, selectors.EVENT_READ, arrived)

    def _run(self) -> None:
        while not self._ends:
            due_s = self._on_way[0][0] - time.monotonic() if self._on_way else None
            for key, _ in self._selector.select(due_s):
                with contextlib.suppress(OSError):  # nothing there after all, or no one at the other end
                    key.data()
            self._deliver()

    def _deliver(self) -> None:
        now = time.monotonic()
        while self._on_way and self._on_way[0][0] <= now:
            _, _, number, way, send, data = heapq.heappop(self._on_way)
            way.counts.delivered += 1
            way.counts.overtaken += number < way.newest
            way.newest = max(way.newest, number)
            if way is self._to_device:
                self.delivered.append(data)
            with contextlib.suppress(OSError):
                send(data)

    def _pass(self, way: Way, send: Callable[[bytes], None], data: bytes) -> None:
        """A datagram meets its fate; of the generator it takes four numbers, whatever becomes of it."""
        lost, doubled, *delays = (way.random.random() for _ in range(4))
        number = way.counts.came
        way.counts.came += 1
        if lost < self.loss:
            way.counts.lost += 1
            return
        copies = delays if doubled < self.duplicate else delays[:1]
        way.counts.doubled += len(copies) - 1
        least, most = self.delay_ms
        for part in copies:
            at = time.monotonic() + 1e-3 * (least + part * (most - least))
            heapq.heappush(self._on_way, (at, next(self._serial), number, way, send, data))

    def _from_host(self) -> None:
        data, host = self._front.recvfrom(DATAGRAM_MAX)
        if host not in self._links:
            link = self._links[host] = self._udp(self.local, 0)
            link.connect((self.device, UDP_PORT))
            self._watch(link, lambda: self._answer(link, host))
        self._pass(self._to_device, self._links[host].send, data)

    def _answer(self, link: socket.socket, host: Peer) -> None:
        self._to(host, link.recv(DATAGRAM_MAX))

    def _status(self, status: socket.socket, port: int) -> None:
        data = status.recv(DATAGRAM_MAX)
        for address in {address for address, _ in self._links}:
            self._to((address, port), data)

    def _to(self, host: Peer, data: bytes) -> None:
        self._pass(self._to_host, lambda data: self._front.sendto(data, host), data)

    # ---- TCP ----

    def _accept(self, listener: socket.socket) -> None:
        while not self._ends:
            try:
                host, _ = listener.accept()
            except OSError:  # closed
                return
            self._keep(host)
            try:
                device = self._keep(socket.create_connection((self.device, CONTROL_PORT), HANG_S, (self.local, 0)))
            except OSError:
                host.close()
                continue
            device.settimeout(None)
            for each in (host, device):
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._start(_copy, host, device)
            self._start(_copy, device, host)


def _copy(source: socket.socket, sink: socket.socket) -> None:
    """Until one of them ends, and then the other one."""
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    with contextlib.suppress(OSError):
        sink.shutdown(socket.SHUT_RDWR)
