"""A network of this computer for a virtual chip, without a right to make one: libslirp by ctypes.

The chip is alone in 10.0.2.0/24, gets its address by DHCP, and reaches nothing outside. Ports of this computer lead to
ports of the chip. Time is the chip's, so a slow computer is no slow network.
"""

from __future__ import annotations

import contextlib
import ctypes
import ipaddress
import select
import socket
import struct
import sys
from collections import deque
from collections.abc import Callable
from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_bool,
    c_char_p,
    c_int,
    c_int64,
    c_size_t,
    c_ssize_t,
    c_uint8,
    c_uint32,
    c_void_p,
)
from functools import cache
from typing import Any

from wificnc.errors import ServeError

CHIP_ADDRESS = "10.0.2.15"
_NETWORK, _MASK, _HOST, _NAMES = "10.0.2.0", "255.255.255.0", "10.0.2.2", "10.0.2.3"
LIBRARIES = (
    "libslirp.so.0",
    "libslirp.0.dylib",
    "/opt/homebrew/lib/libslirp.0.dylib",
    "/usr/local/lib/libslirp.0.dylib",
    "libslirp-0.dll",
)
PACKAGE_HINT = (
    "Debian, Ubuntu: apt install libslirp0; Fedora: dnf install libslirp; macOS: brew install libslirp; "
    "Windows: MSYS2 has it; or --network off"
)
CONFIG_VERSION = 1
NS_PER_MS = 1_000_000
IN, OUT, URGENT = 1, 2, 4  # SLIRP_POLL_
ICMP, TCP, UDP, SYN, ACK, DHCP_CLIENT = 1, 6, 17, 0x02, 0x10, 68
LOOPBACK = 127
WHOLE = 42  # bytes of the shortest frame that says something: ARP, and UDP without data
TRIES = 20  # for a free port, which another program may take meanwhile


class _Address(Structure):
    """struct in_addr, network byte order"""

    _fields_ = (("bits", c_uint32),)


class _Config(Structure):
    """SlirpConfig, version 1"""

    _fields_ = (
        ("version", c_uint32),
        ("restricted", c_int),
        ("in_enabled", c_bool),
        *((name, _Address) for name in ("network", "mask", "host")),
        ("in6_enabled", c_bool),
        ("prefix6", c_uint32 * 4),
        ("prefix6_bits", c_uint8),
        ("host6", c_uint32 * 4),
        *((name, c_char_p) for name in ("host_name", "tftp_server", "tftp_path", "boot_file")),
        ("dhcp_start", _Address),
        ("name_server", _Address),
        ("name_server6", c_uint32 * 4),
        ("dns_search", c_void_p),
        ("domain", c_char_p),
        ("mtu", c_size_t),
        ("mru", c_size_t),
        ("disable_host_loopback", c_bool),
        ("enable_emu", c_bool),
    )


_TimerCall = CFUNCTYPE(None, c_void_p)
_CALLBACKS = (
    ("send_packet", CFUNCTYPE(c_ssize_t, c_void_p, c_size_t, c_void_p)),
    ("guest_error", CFUNCTYPE(None, c_char_p, c_void_p)),
    ("clock_get_ns", CFUNCTYPE(c_int64, c_void_p)),
    ("timer_new", CFUNCTYPE(c_void_p, _TimerCall, c_void_p, c_void_p)),
    ("timer_free", CFUNCTYPE(None, c_void_p, c_void_p)),
    ("timer_mod", CFUNCTYPE(None, c_void_p, c_int64, c_void_p)),
    ("register_poll_fd", CFUNCTYPE(None, c_int, c_void_p)),
    ("unregister_poll_fd", CFUNCTYPE(None, c_int, c_void_p)),
    ("notify", CFUNCTYPE(None, c_void_p)),
)
_AddPoll = CFUNCTYPE(c_int, c_int, c_int, c_void_p)
_GetEvents = CFUNCTYPE(c_int, c_int, c_void_p)


class _Callbacks(Structure):
    """SlirpCb, of version 1"""

    _fields_ = _CALLBACKS


_PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "slirp_new": (c_void_p, (POINTER(_Config), POINTER(_Callbacks), c_void_p)),
    "slirp_cleanup": (None, (c_void_p,)),
    "slirp_pollfds_fill": (None, (c_void_p, POINTER(c_uint32), _AddPoll, c_void_p)),
    "slirp_pollfds_poll": (None, (c_void_p, c_int, _GetEvents, c_void_p)),
    "slirp_input": (None, (c_void_p, c_char_p, c_int)),
    "slirp_add_hostfwd": (c_int, (c_void_p, c_int, _Address, c_int, _Address, c_int)),
}


@cache
def _load() -> ctypes.CDLL | None:
    """@return None: it is not installed"""
    for name in LIBRARIES:
        try:
            library = ctypes.CDLL(name)
            for function, (result, arguments) in _PROTOTYPES.items():
                getattr(library, function).restype = result
                getattr(library, function).argtypes = arguments
        except (OSError, AttributeError):
            continue
        return library
    return None


def has_slirp() -> bool:
    """Whether libslirp is installed."""
    return _load() is not None


def _address(text: str) -> _Address:
    return _Address(int.from_bytes(ipaddress.IPv4Address(text).packed, sys.byteorder))


class UserNetwork:
    """From its making to close(). Raises ServeError where libslirp is missing."""

    def __init__(self) -> None:
        library = _load()
        if library is None:
            raise ServeError("a network for the virtual chip needs libslirp, which is not installed", PACKAGE_HINT)
        self._library = library
        self._frames: deque[bytes] = deque()
        self._now_ns = 0
        self._timers: dict[int, tuple[Callable[[int | None], None], int | None, int | None]] = {}
        self._polls: list[tuple[int, int]] = []
        self._found: list[int] = []
        self._answering: set[int] = {DHCP_CLIENT}  # UDP ports of the chip
        self._senders: dict[int, bytes] = {}  # by their UDP ports: programs at 127.x.y.z
        self._sender: bytes | None = None  # the last one
        config = _Config(version=CONFIG_VERSION, in_enabled=True)
        config.network, config.mask, config.host = map(_address, (_NETWORK, _MASK, _HOST))
        config.dhcp_start, config.name_server = _address(CHIP_ADDRESS), _address(_NAMES)
        own = {name: getattr(self, f"_{name}") for name, _ in _CALLBACKS}
        self._callbacks = _Callbacks(**{name: kind(own[name]) for name, kind in _CALLBACKS})
        self._add_poll, self._get_events = _AddPoll(self._on_add_poll), _GetEvents(self._on_get_events)
        self._slirp = library.slirp_new(ctypes.byref(config), ctypes.byref(self._callbacks), None)
        if not self._slirp:
            raise ServeError("libslirp does not start")

    def close(self) -> None:
        """Ends all connections and forwarded ports."""
        if self._slirp:
            self._library.slirp_cleanup(self._slirp)
        self._slirp = None

    def send(self, frame: bytes) -> None:
        """A frame of the chip. It answers those who call it; what it begins itself goes nowhere."""
        if self._is_answer(frame):
            frame = self._to_sender(frame)
            self._library.slirp_input(self._slirp, frame, len(frame))

    def _is_answer(self, frame: bytes) -> bool:
        """ARP; ping; DHCP; of TCP all but a call, of UDP what leaves a forwarded port. libslirp's own way to allow no
        more (restricted) drops the answers of forwarded UDP ports, too."""
        if len(frame) < WHOLE or frame[12:14] != b"\x08\x00":
            return len(frame) >= WHOLE and frame[12:14] == b"\x08\x06"
        at = 14 + 4 * (frame[14] & 15)
        protocol, to, ports = frame[23], frame[30:34], frame[at : at + 4]
        if to != b"\xff" * 4 and to[:3] != ipaddress.IPv4Address(_NETWORK).packed[:3]:
            return False
        if protocol == TCP:
            return len(frame) > at + 13 and frame[at + 13] & (SYN | ACK) != SYN
        return protocol == ICMP or (protocol == UDP and int.from_bytes(ports[:2], "big") in self._answering)

    def receive(self, now_ns: int) -> list[bytes]:
        """What has come for the chip until now."""
        self._now_ns = now_ns
        self._polls.clear()
        self._library.slirp_pollfds_fill(self._slirp, ctypes.byref(c_uint32()), self._add_poll, None)
        wanted = [[fd for fd, events in self._polls if events & each] for each in (IN, OUT, URGENT)]
        ready = select.select(wanted[0], wanted[1], wanted[2], 0) if self._polls else ([], [], [])
        sets = [(bit, set(fds)) for bit, fds in zip((IN, OUT, URGENT), ready, strict=True)]
        self._found = [sum(bit for bit, fds in sets if fd in fds and events & bit) for fd, events in self._polls]
        self._library.slirp_pollfds_poll(self._slirp, 0, self._get_events, None)
        self._fire_timers()
        frames = [self._from_host(frame) for frame in self._frames]
        self._frames.clear()
        return frames

    def _from_host(self, frame: bytes) -> bytes:
        """libslirp makes 127.0.0.1 its own address, but of UDP no other address of this computer's own network, which a
        chip must not take from a cable."""
        if not _is_udp(frame):
            return frame
        port, address = int.from_bytes(frame[34:36], "big"), frame[26:30]
        self._sender = address if address[0] == LOOPBACK else None
        if self._sender is None:
            self._senders.pop(port, None)
            return frame
        self._senders[port] = address
        return with_address(frame, 26, ipaddress.IPv4Address(_HOST).packed)

    def _to_sender(self, frame: bytes) -> bytes:
        """The way back; what goes to another port than the question came from goes to the last one who asked."""
        if not _is_udp(frame) or frame[30:34] != ipaddress.IPv4Address(_HOST).packed:
            return frame
        address = self._senders.get(int.from_bytes(frame[36:38], "big"), self._sender)
        return with_address(frame, 30, address) if address else frame

    def forward(self, host: str, port: int, chip_port: int, *, udp: bool = False) -> int:
        """A port of this computer leads to one of the chip. @param port  0: any free one. @return the port

        Raises:
            ServeError: it is in use, or the address is not one of this computer's.
        """
        at = _ipv4(host)
        for _ in range(TRIES if port == 0 else 1):
            number = port or _free_port(at, udp)
            result = self._library.slirp_add_hostfwd(
                self._slirp, int(udp), _address(at), number, _address(CHIP_ADDRESS), chip_port
            )
            if result == 0:
                self._answering |= {chip_port} if udp else set()
                return number
        what = f"{'UDP' if udp else 'TCP'} port {host}:{port}"
        raise ServeError(f"cannot listen at {what}: {_why(at, port, udp)}", hint="choose another address or port")

    # ---- what libslirp calls ----

    def _send_packet(self, data: int, size: int, _: object) -> int:
        self._frames.append(ctypes.string_at(data, size))
        return size

    def _guest_error(self, message: bytes, _: object) -> None:
        """The chip has sent what libslirp does not understand: dropped, as on any network."""

    def _clock_get_ns(self, _: object) -> int:
        return self._now_ns

    def _timer_new(self, call: Callable[[int | None], None], argument: int | None, _: object) -> int:
        number = max(self._timers, default=0) + 1
        self._timers[number] = (call, argument, None)
        return number

    def _timer_free(self, number: int, _: object) -> None:
        self._timers.pop(number, None)

    def _timer_mod(self, number: int, due_ms: int, _: object) -> None:
        call, argument, _due = self._timers[number]
        self._timers[number] = (call, argument, due_ms)

    def _fire_timers(self) -> None:
        for number, (call, argument, due_ms) in list(self._timers.items()):
            if due_ms is not None and due_ms * NS_PER_MS <= self._now_ns:
                self._timers[number] = (call, argument, None)
                call(argument)

    def _register_poll_fd(self, _fd: int, _: object) -> None:
        """Each is named again before each poll."""

    def _unregister_poll_fd(self, _fd: int, _: object) -> None:
        """Each is named again before each poll."""

    def _notify(self, _: object) -> None:
        """It is asked each millisecond anyway."""

    def _on_add_poll(self, fd: int, events: int, _: object) -> int:
        self._polls.append((fd, events))
        return len(self._polls) - 1

    def _on_get_events(self, index: int, _: object) -> int:
        return self._found[index]


def _is_udp(frame: bytes) -> bool:
    """Over IPv4 without options."""
    return len(frame) >= WHOLE and frame[12:15] == b"\x08\x00\x45" and frame[23] == UDP


def with_address(frame: bytes, at: int, address: bytes) -> bytes:
    """A UDP frame with another address of IPv4 at its place; both sums follow (RFC 1624)."""
    changed = bytearray(frame)
    change = sum(struct.unpack("!2H", address)) + sum(0xFFFF - word for word in struct.unpack_from("!2H", frame, at))
    changed[at : at + 4] = address
    for place in (24, 40):
        checksum = int.from_bytes(frame[place : place + 2], "big")
        if place == 40 and checksum == 0:  # UDP without a sum
            continue
        total = (0xFFFF - checksum) + change
        while total > 0xFFFF:
            total = (total & 0xFFFF) + (total >> 16)
        fresh = 0xFFFF - total
        changed[place : place + 2] = (fresh or 0xFFFF if place == 40 else fresh).to_bytes(2, "big")
    return bytes(changed)


def _ipv4(host: str) -> str:
    """Raises ServeError."""
    try:
        return str(socket.getaddrinfo(host, None, socket.AF_INET)[0][4][0])
    except OSError as err:
        raise ServeError(f"{host} has no IPv4 address, and the chip's network has no other", "127.0.0.1") from err


def _bound(at: str, port: int, udp: bool) -> socket.socket:
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM if udp else socket.SOCK_STREAM)
    try:
        taken.bind((at, port))
    except OSError:
        taken.close()
        raise
    return taken


def _free_port(at: str, udp: bool) -> int:
    with contextlib.suppress(OSError), _bound(at, 0, udp) as taken:
        return int(taken.getsockname()[1])
    return 0


def _why(at: str, port: int, udp: bool) -> str:
    try:
        _bound(at, port, udp).close()
    except OSError as err:
        return err.strerror or str(err)
    return "libslirp refuses it"
