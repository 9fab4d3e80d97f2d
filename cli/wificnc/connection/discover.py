"""Controllers on this network, found by multicast DNS (RFC 6762): one question, and the answers of a moment."""

from __future__ import annotations

import socket
import struct
import time
from dataclasses import dataclass, field

from wificnc.errors import LinkError

GROUP = ("224.0.0.251", 5353)
SERVICE = "_telnet._tcp.local"
TYPE_A, TYPE_PTR, TYPE_TXT, TYPE_SRV = 1, 12, 16, 33
JUMPS_MAX = 16
PACKET_MAX = 9000


@dataclass
class Found:
    """A controller that has answered."""

    name: str
    address: str = ""
    port: int = 0
    text: dict[str, str] = field(default_factory=dict)

    @property
    def target(self) -> str:
        """For --to."""
        return f"tcp://{self.address}:{self.port}"

    @property
    def page(self) -> str:
        """Of a board: its web server is at HTTP's own port."""
        return f"http://{self.address}/"


def discover(seconds: float, to: tuple[str, int] = GROUP) -> list[Found]:
    """Ask, and listen for that long. Raises LinkError when there is no network."""
    found: dict[str, Found] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 255)
        try:
            asking.sendto(question(SERVICE, TYPE_PTR), to)
        except OSError as err:
            raise LinkError(
                f"cannot search this network: {err.strerror}", hint="check that this computer is connected to a network"
            ) from err
        deadline = time.monotonic() + seconds
        while (left_s := deadline - time.monotonic()) > 0:
            asking.settimeout(left_s)
            try:
                packet = asking.recv(PACKET_MAX)
            except OSError:
                break
            for one in controllers(packet):
                found[one.name] = one
    return sorted(found.values(), key=lambda one: one.name)


def question(name: str, kind: int) -> bytes:
    """A query with one question."""
    labels = b"".join(bytes([len(label)]) + label.encode() for label in name.split("."))
    return struct.pack(">6H", 0, 0, 1, 0, 0, 0) + labels + b"\0" + struct.pack(">2H", kind, 1)


def controllers(packet: bytes) -> list[Found]:
    """The controllers that a packet tells of, those that say `wificnc`; none when it is damaged."""
    try:
        records = read_records(packet)
    except (IndexError, struct.error, UnicodeDecodeError, ValueError):
        return []
    found = []
    for name, kind, _, _ in records:
        if kind == TYPE_SRV and name.endswith("." + SERVICE):
            found.append(_controller(packet, name, records))
    return [one for one in found if one.address and "wificnc" in one.text]


Record = tuple[str, int, int, int]  # name, type, where its data begin and end


def _controller(packet: bytes, name: str, records: list[Record]) -> Found:
    one = Found(name.removesuffix("." + SERVICE))
    host = ""
    for record_name, kind, begin, end in records:
        if record_name == name and kind == TYPE_SRV:
            one.port = struct.unpack_from(">H", packet, begin + 4)[0]
            host, _ = _read_name(packet, begin + 6)
        elif record_name == name and kind == TYPE_TXT:
            one.text = _read_text(packet[begin:end])
    for record_name, kind, begin, _ in records:
        if record_name == host and kind == TYPE_A:
            one.address = ".".join(str(byte) for byte in packet[begin : begin + 4])
    return one


def read_records(packet: bytes) -> list[Record]:
    """All resource records of a packet. Raises IndexError, struct.error or ValueError when it is damaged."""
    _, _, questions, *counts = struct.unpack_from(">6H", packet)
    at = 12
    for _ in range(questions):
        _, at = _read_name(packet, at)
        at += 4
    records: list[Record] = []
    for _ in range(sum(counts)):
        name, at = _read_name(packet, at)
        kind, _, _, size = struct.unpack_from(">HHIH", packet, at)
        at += 10
        if at + size > len(packet):
            raise ValueError("a record is cut off")
        records.append((name, kind, at, at + size))
        at += size
    return records


def _read_name(packet: bytes, at: int) -> tuple[str, int]:
    """A name in lower case, and where it ends."""
    labels: list[str] = []
    end = None
    jumps = 0
    while (length := packet[at]) != 0:
        if length >= 0xC0:
            end = at + 2 if end is None else end
            at = (length & 0x3F) << 8 | packet[at + 1]
            jumps += 1
            if jumps > JUMPS_MAX:
                raise ValueError("names point in a circle")
            continue
        labels.append(packet[at + 1 : at + 1 + length].decode())
        at += 1 + length
    return ".".join(labels).lower(), (at + 1 if end is None else end)


def _read_text(data: bytes) -> dict[str, str]:
    """key=value strings; a key alone has an empty value."""
    text: dict[str, str] = {}
    at = 0
    while at < len(data):
        key, _, value = data[at + 1 : at + 1 + data[at]].decode("utf-8", "replace").partition("=")
        text[key] = value
        at += 1 + data[at]
    return text
