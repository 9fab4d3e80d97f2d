"""A computer of Ethernet frames, for the other end of a network: ARP, UDP and as much TCP as a test needs."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

MAC, ALL = bytes.fromhex("0208dc010203"), b"\xff" * 6
OWN, HOST, ANY, EVERYONE = bytes((10, 0, 2, 15)), bytes((10, 0, 2, 2)), bytes(4), b"\xff" * 4
ARP, IPV4 = b"\x08\x06", b"\x08\x00"
ICMP, TCP, UDP = 1, 6, 17
FIN, SYN, PUSH, ACK = 0x01, 0x02, 0x08, 0x10


def checksum(data: bytes) -> int:
    """RFC 1071."""
    total = sum(struct.unpack(f"!{len(data) // 2 + len(data) % 2}H", data + bytes(len(data) % 2)))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return 0xFFFF - total


def ip_packet(protocol: int, source: bytes, to: bytes, data: bytes) -> bytes:
    head = struct.pack("!BBHHHBBH4s4s", 0x45, 0, 20 + len(data), 1, 0, 64, protocol, 0, source, to)
    return head[:10] + checksum(head).to_bytes(2, "big") + head[12:] + data


def _pseudo(protocol: int, source: bytes, to: bytes, size: int) -> bytes:
    return source + to + struct.pack("!BBH", 0, protocol, size)


def udp_packet(source: bytes, to: bytes, ports: tuple[int, int], data: bytes) -> bytes:
    head = struct.pack("!HHHH", *ports, 8 + len(data), 0)
    total = checksum(_pseudo(UDP, source, to, 8 + len(data)) + head + data) or 0xFFFF
    return ip_packet(UDP, source, to, head[:6] + total.to_bytes(2, "big") + data)


def sums_are_right(frame: bytes) -> bool:
    """Of IPv4, and of UDP or TCP in it."""
    source, to, protocol, whole = frame[26:30], frame[30:34], frame[23], int.from_bytes(frame[16:18], "big")
    data = frame[34 : 14 + whole]
    return checksum(frame[14:34]) == 0 and checksum(_pseudo(protocol, source, to, len(data)) + data) == 0


@dataclass
class Guest:
    """send: a frame of ours. Answers ARP by itself; what else comes is kept."""

    send: Callable[[bytes], None]
    gateway: bytes = ALL  # MAC of the network
    got: list[bytes] = field(default_factory=list)

    def take(self, frame: bytes) -> None:
        if frame[12:14] == ARP:
            operation, asker, to = frame[21], frame[22:32], frame[38:42]
            self.gateway = asker[:6]
            if operation == 1 and to == OWN:
                self.send(asker[:6] + MAC + ARP + struct.pack("!HHBBH", 1, 0x800, 6, 4, 2) + MAC + OWN + asker)
            return
        self.gateway = frame[6:12]
        self.got.append(frame)

    def ip(self, packet: bytes, to: bytes | None = None) -> None:
        self.send((to or self.gateway) + MAC + IPV4 + packet)

    def udp(self, ports: tuple[int, int], data: bytes, to: bytes = HOST, source: bytes = OWN) -> None:
        self.ip(udp_packet(source, to, ports, data))

    def tcp(self, ports: tuple[int, int], numbers: tuple[int, int], flags: int, data: bytes = b"") -> None:
        """@param numbers  sequence, acknowledgment"""
        head = struct.pack("!HHIIBBHHH", *ports, *numbers, 0x50, flags, 8192, 0, 0)
        total = checksum(_pseudo(TCP, OWN, HOST, 20 + len(data)) + head + data)
        self.ip(ip_packet(TCP, OWN, HOST, head[:16] + total.to_bytes(2, "big") + head[18:] + data))
