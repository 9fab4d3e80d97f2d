"""Whole packets: the header around a payload."""

from __future__ import annotations

import binascii
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from wificnc.connection.wmc3.layout import MAGIC, MOTION_SEGMENTS_MAX, PACKETS, VERSION, Header, Segment
from wificnc.connection.wmc3.packing import Layout

CHECKSUM_AT = 16
HEADER_SIZE = Header.size()


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    return binascii.crc_hqx(data, 0xFFFF)


def build(payload: Layout, sequence: int = 0, timestamp_us: int = 0, segments: Sequence[Segment] = ()) -> bytes:
    """A packet. Raises struct.error when a number does not fit its field, ValueError for too many segments."""
    if len(segments) > MOTION_SEGMENTS_MAX:
        raise ValueError(f"{len(segments)} segments; a packet has at most {MOTION_SEGMENTS_MAX}")
    body = payload.pack() + b"".join(segment.pack() for segment in segments)
    head = Header(MAGIC, VERSION, payload.TYPE, len(body), sequence & 0xFFFFFFFF, timestamp_us & 0xFFFFFFFF, 0).pack()
    checksum = crc16(head + body)
    return head[:CHECKSUM_AT] + struct.pack("<H", checksum) + body


@dataclass(frozen=True)
class Packet:
    """What came."""

    header: Header
    payload: Layout
    body: bytes  # the payload as it came
    segments: tuple[Segment, ...] = ()


def parse(data: bytes) -> Packet | None:
    """A packet, or None: too short, another protocol, damaged, or of an unknown type. Bytes behind it are ignored."""
    if len(data) < HEADER_SIZE:
        return None
    header = Header.unpack(data)
    kind = PACKETS.get(header.type)
    whole = data[: HEADER_SIZE + header.length]
    if (header.magic, header.version) != (MAGIC, VERSION) or kind is None or len(whole) < HEADER_SIZE + header.length:
        return None
    if crc16(whole[:CHECKSUM_AT] + bytes(2) + whole[HEADER_SIZE:]) != header.checksum:
        return None
    body = whole[HEADER_SIZE:]
    if len(body) < kind.size():
        return None
    payload = kind.unpack(body)
    segments = _segments(payload, body)
    return None if segments is None else Packet(header, payload, body, segments)


def _segments(payload: Layout, body: bytes) -> tuple[Segment, ...] | None:
    """Those that follow the payload, or None: they do not fit."""
    count = getattr(payload, "count", 0)
    if count > MOTION_SEGMENTS_MAX or len(body) < payload.size() + count * Segment.size():
        return None
    return tuple(Segment.unpack(body[payload.size() + n * Segment.size() :]) for n in range(count))
