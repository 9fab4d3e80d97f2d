"""The C codec through ctypes: core/wire."""

from __future__ import annotations

import ctypes
import re

from c_library import LIB
from wificnc.connection.wmc3.layout import PACKETS, Segment
from wificnc.connection.wmc3.packet import HEADER_SIZE

PACKET_MAX = 512


def c_name(kind: type) -> str:
    """`StreamAck` as `stream_ack`."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower()


def opens(data: bytes) -> bool:
    return bool(LIB.wire_open(data, len(data), ctypes.create_string_buffer(64)))


def again(name: str, payload: bytes) -> bytes:
    """A payload read by C and written by C."""
    inside = (ctypes.c_uint64 * 64)()
    out = ctypes.create_string_buffer(b"\xaa" * PACKET_MAX, PACKET_MAX)
    getattr(LIB, f"wire_get_{name}")(payload, inside)
    getattr(LIB, f"wire_put_{name}")(out, inside)
    return out.raw[: len(payload)]


def rebuild(data: bytes) -> bytes:
    """A whole packet taken apart and put together by C."""
    head_size = PACKETS[data[5]].size()
    body = data[HEADER_SIZE:]
    head = body[:head_size]
    if head.strip(b"\0") or PACKETS[data[5]].FORMAT.strip("<0123456789x"):
        head = again(c_name(PACKETS[data[5]]), head)
    rest = body[head_size:]
    parts = [again("segment", rest[at : at + Segment.size()]) for at in range(0, len(rest), Segment.size())]
    payload = head + b"".join(parts)
    packet = ctypes.create_string_buffer(bytes(HEADER_SIZE) + payload, PACKET_MAX)
    sequence, timestamp = (int.from_bytes(data[at : at + 4], "little") for at in (8, 12))
    size = LIB.wire_close(packet, data[5], len(payload), sequence, timestamp)
    return packet.raw[:size]
