"""A controller on the network, over the binary protocol. Sockets and the wall clock; every wait has an end."""

from __future__ import annotations

import difflib
import ipaddress
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import TypeVar

from wificnc import __version__
from wificnc.connection.access import ROUNDS_MIN, key_secret
from wificnc.connection.wmc3.keys import KEYS, Key
from wificnc.connection.wmc3.layout import (
    CONTROL_PORT,
    JOG_REPEAT_MS,
    REPLY_TIMEOUT_MS,
    STATUS_PORT,
    UDP_PORT,
    Ack,
    Authenticate,
    Authenticated,
    Capability,
    Challenge,
    ChallengeResponse,
    ConfigGet,
    ConfigSave,
    ConfigSet,
    ConfigValue,
    Handshake,
    HandshakeResponse,
    Jog,
    JogStop,
    Refusal,
    Refused,
    Segment,
    Status,
    StreamAck,
    StreamClose,
    StreamOpen,
    StreamOpened,
    Take,
    Type,
    ValueType,
)
from wificnc.connection.wmc3.packet import HEADER_SIZE, Packet, build, parse
from wificnc.connection.wmc3.packing import Layout
from wificnc.connection.wmc3.refused import refused_error
from wificnc.connection.wmc3.seal import Sealer, proof
from wificnc.connection.wmc3.stream import StreamSender
from wificnc.errors import LinkError, ProtocolError, RefusedError, UserError
from wificnc.files.digits import whole_number

TIMEOUT_S = REPLY_TIMEOUT_MS / 1000
JOG_REPEAT_S = JOG_REPEAT_MS / 1000
TURN_S = 0.001  # a stream looks around this often
ANSWERED_SIZE = HEADER_SIZE + Status.size()
PROOF_S = 20.0  # a proof waits for its turn behind those of other connections, 4 s each (core/base/lockout.h)
LOST_S = 3.0  # a device that acknowledges nothing for this long is gone
LayoutT = TypeVar("LayoutT", bound=Layout)
CODES = {ValueType.U8: "<B", ValueType.U16: "<H", ValueType.U32: "<I", ValueType.I32: "<i", ValueType.FLOAT: "<f"}


def find_key(name: str) -> tuple[int, Key]:
    """A key by name (`max_rate_mm_min.x` or `step_pin.3` where there are several) or number. Raises RefusedError."""
    base, dot, which = name.partition(".")
    for row in KEYS:
        if base.lower().startswith("0x") and not dot:
            number = _number(base)
            if row.key <= number < row.key + row.count:
                return number, row
        if row.name == base:
            return row.key + _index(row, name, which), row
    names = [row.name for row in KEYS]
    near = difflib.get_close_matches(base, names, 1)
    hint = f"did you mean {near[0]}?" if near else "wificnc wmc3 config lists all"
    raise RefusedError(f"unknown key {name!r}", hint=hint)


def _number(text: str) -> int:
    try:
        return int(text, 16)
    except ValueError:
        return -1


def _index(row: Key, name: str, which: str) -> int:
    """Of several keys: the one that is meant."""
    letters = "xyzabc"[: row.count] if row.count == len("xyzabc") else ""
    index = -1 if row.count > 1 else 0
    if which:
        index = whole_number(which) if which.isdecimal() else letters.find(which.lower())
    if 0 <= index < row.count and (row.count > 1 or not which):
        return index
    last = letters[-1:] or str(row.count - 1)
    several = f"{row.name}.{letters[:1] or 0} to {row.name}.{last}"
    raise RefusedError(
        f"{name!r} is not one key" if not which else f"unknown key {name!r}",
        hint=several if row.count > 1 else row.name,
    )


def pack_value(row: Key, text: str) -> tuple[ValueType, bytes]:
    """A value as the key has it. Raises RefusedError."""
    kind = ValueType[row.type.upper()]
    try:
        if kind == ValueType.STRING:
            return kind, text.encode()[:63].ljust(64, b"\0")
        value = float(text) if kind == ValueType.FLOAT else int(text, 0)
        return kind, struct.pack(CODES[kind], value).ljust(64, b"\0")
    except (ValueError, struct.error, OverflowError):
        raise RefusedError(f"{text!r} is not a value of {row.name}", hint=value_hint(row)) from None


def value_hint(row: Key) -> str:
    """What a key takes."""
    kind = {"float": "a number", "string": "text"}.get(row.type, f"a whole number ({row.type})")
    unit = f" {row.unit}" if row.unit else ""
    limits = f", {row.least:g} to {row.most:g}" if row.least is not None and row.most is not None else ""
    return f"it is {kind}{limits}{unit}"


def unpack_value(value: ConfigValue) -> int | float | str:
    """A value by its own type."""
    if value.value_type in CODES:
        number: int | float = struct.unpack_from(CODES[ValueType(value.value_type)], value.value)[0]
        return number
    return value.value.split(b"\0")[0].decode(errors="replace")


class Device:
    """One controller. Raises LinkError when it cannot be reached or is silent, RefusedError when it says no."""

    def __init__(self, address: str, key: str = "", timeout_s: float = TIMEOUT_S) -> None:
        self.address = address
        self._timeout_s = timeout_s
        self._sequence = int.from_bytes(os.urandom(2), "little") << 8  # not that of the host program before
        self._tcp: socket.socket | None = None
        self._status: socket.socket | None = None
        self._local = _local_address(address)
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind((self._local, 0))
        self._udp.settimeout(TURN_S)
        self._key = key
        self._sealer: Sealer | None = None

    def __enter__(self) -> Device:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for each in (self._tcp, self._status, self._udp):
            if each:
                each.close()

    # ---- packets ----

    def _build(self, payload: Layout, segments: Sequence[Segment] = ()) -> bytes:
        self._sequence += 1
        return build(payload, self._sequence, int(time.monotonic() * 1e6), segments)

    def post(self, payload: Layout, segments: Sequence[Segment] = ()) -> None:
        """A datagram, sealed where the device knows this host. It may be lost."""
        if self._key:
            self._connection()
        packet = self._build(payload, segments)
        try:
            self._udp.sendto(self._sealer.seal(packet) if self._sealer else packet, (self.address, UDP_PORT))
        except OSError as err:
            raise LinkError(f"cannot send to {self.address}: {err.strerror}") from err

    def _connection(self) -> socket.socket:
        if self._tcp is None:
            try:
                self._tcp = socket.create_connection((self.address, CONTROL_PORT), self._timeout_s, (self._local, 0))
            except OSError as err:
                raise LinkError(
                    f"no device at {self.address}: {err.strerror or err}",
                    hint="check that it is on; `wificnc wmc3 discover` finds it",
                ) from err
            self._tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self._key and self.handshake().capabilities & Capability.LOCKED:
                self._authenticate()
        return self._tcp

    def _authenticate(self) -> None:
        asked = self.request(Challenge(), ChallengeResponse)
        if asked.rounds < ROUNDS_MIN:
            raise ProtocolError(f"{self.address} asks for a proof that gives the access key away")
        secret = key_secret(self._key, asked.salt, asked.rounds)
        nonce = os.urandom(len(asked.nonce))
        connection = self._connection()
        connection.settimeout(max(PROOF_S, self._timeout_s))
        session = self.request(Authenticate(nonce, proof(secret, asked.nonce, nonce)), Authenticated).session
        connection.settimeout(self._timeout_s)
        self._sealer = Sealer.derive(session, secret, asked.nonce, nonce)

    def _exchange(self, payload: Layout) -> Packet:
        connection = self._connection()
        data = self._build(payload)
        try:
            connection.sendall(struct.pack("<H", len(data)) + data)
            size = struct.unpack("<H", self._receive(connection, 2))[0]
            packet = parse(self._receive(connection, size))
        except TimeoutError as err:
            raise LinkError(f"{self.address} does not answer", hint="check that it is a WMC3 device") from err
        except OSError as err:
            raise LinkError(f"the connection to {self.address} broke: {err.strerror or err}") from err
        if packet is None:
            raise ProtocolError(f"{self.address} sent data that is not a packet")
        return packet

    @staticmethod
    def _receive(connection: socket.socket, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = connection.recv(size - len(data))
            if not part:
                raise LinkError("the device has closed the connection")
            data += part
        return data

    def request(
        self, payload: Layout, reply: type[LayoutT], what: str = "", hints: Mapping[Refusal, str] | None = None
    ) -> LayoutT:
        """A request and its reply. @param what, hints: of refused_error()"""
        packet = self._exchange(payload)
        if isinstance(packet.payload, Refused):
            raise refused_error(Type(payload.TYPE), packet.payload.reason, what, hints)
        if not isinstance(packet.payload, reply):
            raise ProtocolError(f"{self.address} answers {type(packet.payload).__name__} to {type(payload).__name__}")
        return packet.payload

    def command(self, payload: Layout) -> None:
        """A command by TCP: done when this returns."""
        self.request(payload, Ack)

    # ---- what there is to ask ----

    def handshake(self) -> HandshakeResponse:
        major, minor, patch = (int(part) for part in __version__.split(".")[:3])
        return self.request(Handshake(major << 24 | minor << 16 | patch, "wificnc"), HandshakeResponse)

    def prove_key(self) -> None:
        """Whether the controller needs it now or not. Raises RefusedError: it is another key."""
        self._authenticate()

    def get(self, key: int) -> int | float | str:
        return unpack_value(self.request(ConfigGet(key=key), ConfigValue))

    def set(self, key: int, kind: ValueType, value: bytes, what: str = "", limits: str = "") -> None:
        """@param what: the key and value as the user has said them. @param limits: what the key takes"""
        hints = {Refusal.RANGE: limits} if limits else {}
        self.request(ConfigSet(key, kind, value), Ack, what or f"0x{key:04X}", hints)

    def save(self) -> None:
        self.command(ConfigSave())

    def reports(self, seconds: float) -> Iterator[Status]:
        """Status reports as they come, for this long. Raises LinkError when there are none."""
        end = time.monotonic() + seconds
        listener = self.listen()
        self.post(JogStop(axis=0xFF))
        heard = False
        while (left := end - time.monotonic()) > 0:
            listener.settimeout(min(left, self._timeout_s))
            try:
                data, (address, _) = listener.recvfrom(512)
            except TimeoutError:
                break
            packet = parse(data)
            if address == self.address and packet and isinstance(packet.payload, Status):
                heard = True
                yield packet.payload
        if not heard:
            raise LinkError(
                f"no status from {self.address}", hint=f"check that no firewall blocks UDP port {STATUS_PORT}"
            )

    def listen(self, alone: bool = True) -> socket.socket:
        """Where its status reports come. alone: False when other programs of this computer may listen to other
        devices; then only what it sends from its port for motion is heard, as our firmware does."""
        if self._status is None:
            self._status = status_socket(self._local or _own_address(self.address))
            if not alone:
                self._status.connect((self.address, UDP_PORT))
        return self._status

    def jog(self, jog: Jog, seconds: float) -> None:
        """Jog for this long, and say so again and again: without that a jog ends by itself (JOG_LIFE_MS)."""
        end = time.monotonic() + seconds
        try:
            self.command(jog)
            while (left := end - time.monotonic()) > 0:
                time.sleep(min(left, JOG_REPEAT_S))
                self.command(jog)
        finally:
            self.command(JogStop(axis=0xFF))

    def take(self, discard: bool = False) -> None:
        """Take control from another host: its jog ends, its queued motion is held, or discarded."""
        self.command(Take(discard=discard))

    # ---- motion ----

    def open_stream(self) -> StreamSender:
        """A stream whose datagrams the caller posts."""
        opened = self.request(StreamOpen(), StreamOpened)
        if opened.refusal != Refusal.NONE:
            raise refused_error(Type.STREAM_OPEN, opened.refusal)
        return StreamSender(opened.stream, opened.capacity)

    def heard(self) -> Iterator[Packet]:
        """What has come by UDP and was not looked at, without waiting."""
        for each in (self._udp, self._status):
            while each and select.select([each], [], [], 0)[0]:
                try:
                    data, (address, _) = each.recvfrom(512)
                except OSError:
                    break
                packet = parse(data)
                if packet and address == self.address:
                    yield packet

    def stream(
        self, segments: Sequence[Segment], progress: Callable[[StreamSender], None] = lambda sender: None
    ) -> StreamSender:
        """Send segments and wait until all are executed. Raises RefusedError when one is refused."""
        sender = self.open_stream()
        sender.put(segments, last=True)
        heard = time.monotonic()
        while not sender.is_executed:
            for payload, some in sender.poll(time.monotonic()):
                self.post(payload, some)
            if ack := self._ack():
                heard = time.monotonic()
                sender.take(ack)
                progress(sender)
            elif time.monotonic() - heard > LOST_S:
                raise LinkError(f"{self.address} does not answer; {sender.done} of {sender.end} segments were executed")
        self.command(StreamClose(sender.stream))
        return sender

    def _ack(self) -> StreamAck | None:
        try:
            packet = parse(self._udp.recv(512))
        except (TimeoutError, ConnectionRefusedError):
            return None
        return packet.payload if packet and isinstance(packet.payload, StreamAck) else None


def _local_address(device: str) -> str:
    """Where to speak from: to a device on this computer from its own address, so that many of them, each with its
    hosts, fit on one computer; else from anywhere."""
    try:
        return device if ipaddress.IPv4Address(device).is_loopback else ""
    except ValueError:
        raise UserError(
            f"{device!r} is not an IPv4 address", hint="like 192.168.1.50; wificnc wmc3 discover finds it"
        ) from None


def _own_address(to: str) -> str:
    """The address of this computer that the device sees."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((to, UDP_PORT))
        except OSError as err:
            raise LinkError(f"no route to {to}: {err.strerror}") from err
        address: str = probe.getsockname()[0]
        return address


def status_socket(address: str) -> socket.socket:
    """Where status reports come. Raises LinkError when another program has the port."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((address, STATUS_PORT))
    except OSError as err:
        listener.close()
        raise LinkError(
            f"UDP port {STATUS_PORT} is in use", hint="status reports arrive there; stop the other host program"
        ) from err
    return listener


def find_devices(seconds: float, broadcast: str = "255.255.255.255") -> Iterator[tuple[str, Status]]:
    """Devices that answer, each once: address and first status."""
    found: set[str] = set()
    end = time.monotonic() + seconds
    asked = float("-inf")
    local = _local_address(broadcast)
    with status_socket(local) as listener, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
        asker.bind((local, 0))
        asker.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        listener.settimeout(0.1)
        while (now := time.monotonic()) < end:
            if now - asked >= 1.0:
                # A locked device answers strangers with no more bytes than they send.
                question = build(JogStop(axis=0xFF), timestamp_us=int(now * 1e6)).ljust(ANSWERED_SIZE, b"\0")
                asker.sendto(question, (broadcast, UDP_PORT))
                asked = now
            try:
                data, (address, _) = listener.recvfrom(512)
            except TimeoutError:
                continue
            packet = parse(data)
            if packet and isinstance(packet.payload, Status) and address not in found:
                found.add(address)
                yield address, packet.payload
