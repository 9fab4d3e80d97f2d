"""The binary protocol's bytes: known packets, the same in C and Python, and nothing damaged gets in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from generate.wire_table import parse_wire
from hypothesis import given
from hypothesis import strategies as st
from wificnc.connection.wmc3.keys import KEYS
from wificnc.connection.wmc3.layout import PACKETS, Header, Motion, Segment, Type
from wificnc.connection.wmc3.packet import HEADER_SIZE, build, crc16, parse
from wificnc.tables.nvs import load_nvs
from wificnc.tables.settings import load_settings, tomllib
from wire_core import c_name, opens, rebuild

ROOT = Path(__file__).resolve().parents[2]
VECTORS = tomllib.loads((ROOT / "protocol/vectors/packets.toml").read_text(encoding="utf-8"))["vector"]
BY_NAME = {c_name(kind): kind for kind in PACKETS.values()}


def bytes_of(vector: dict[str, Any]) -> bytes:
    return bytes.fromhex(vector["hex"]) + bytes(vector.get("zeros", 0))


def fields_of(vector: dict[str, Any]) -> dict[str, Any]:
    fields = {
        name: tuple(value) if isinstance(value, list) else value for name, value in vector.get("fields", {}).items()
    }
    for name in [name for name in fields if name.endswith("_hex")]:
        whole = bytes.fromhex(fields.pop(name))
        kept = name.removesuffix("_hex")
        fields[kept] = whole.ljust(len(getattr(BY_NAME[vector["name"]], kept)), b"\0")
    return fields


def packet_of(vector: dict[str, Any]) -> bytes:
    segments = [Segment(**{**row, "steps": tuple(row["steps"])}) for row in vector.get("segments", [])]
    payload = BY_NAME[vector["name"]](**fields_of(vector))
    return build(payload, vector["sequence"], vector["timestamp_us"], segments)


@pytest.mark.parametrize("vector", VECTORS, ids=[vector["name"] for vector in VECTORS])
def test_known_packets_are_made_and_understood(vector: dict[str, Any]) -> None:
    known = bytes_of(vector)
    assert packet_of(vector).hex() == known.hex()
    assert rebuild(known).hex() == known.hex()
    packet = parse(known)
    assert packet is not None and opens(known)
    assert packet.payload == BY_NAME[vector["name"]](**fields_of(vector))
    assert (packet.header.sequence, packet.header.timestamp_us) == (vector["sequence"], vector["timestamp_us"])


def test_the_checksum_is_the_standard_one() -> None:
    """Python's; the known packets above open in C only with the same."""
    assert crc16(b"123456789") == 0x29B1


# Total bytes of packets as existing hosts and firmwares have them, header included.
SIZES = {
    Type.JOG: 26, Type.JOG_STOP: 22, Type.ESTOP: 18, Type.HOLD: 18, Type.RESUME: 18, Type.RESET: 18, Type.HOME: 22,
    Type.IO_CONTROL: 26, Type.STATUS: 80, Type.HOME_COMPLETE: 22, Type.PROBE_RESULT: 46, Type.ACK: 26,
    Type.HANDSHAKE: 54, Type.HANDSHAKE_RESPONSE: 66, Type.CONFIG_GET: 86, Type.CONFIG_SET: 86, Type.CONFIG_VALUE: 86,
    Type.CONFIG_SAVE: 18, Type.PING: 22, Type.PONG: 22,
}  # fmt: skip


@pytest.mark.parametrize("kind", SIZES)
def test_sizes_are_those_of_the_published_protocol(kind: Type) -> None:
    assert HEADER_SIZE + PACKETS[kind].size() == SIZES[kind]


def test_segment_and_header_sizes() -> None:
    assert (Header.size(), Segment.size()) == (18, 44)
    assert len(build(Motion(count=8), segments=[Segment()] * 8)) == 374


CONTENT = {
    kind: st.binary(min_size=PACKETS[kind].size(), max_size=PACKETS[kind].size()).map(PACKETS[kind].unpack)
    for kind in PACKETS
    if not hasattr(PACKETS[kind], "count") and "s" not in PACKETS[kind].FORMAT
}
SEGMENTS = st.lists(st.binary(min_size=44, max_size=44).map(Segment.unpack), min_size=0, max_size=8)
U32 = st.integers(0, 0xFFFFFFFF)


@given(data=st.data(), kind=st.sampled_from(sorted(CONTENT)), sequence=U32, timestamp=U32)
def test_c_and_python_agree_on_any_content(data: Any, kind: int, sequence: int, timestamp: int) -> None:
    payload = data.draw(CONTENT[kind])
    packet = build(payload, sequence, timestamp)
    parsed = parse(packet)
    assert parsed is not None and parsed.payload == payload
    assert rebuild(packet) == packet


@given(segments=SEGMENTS, sequence=U32)
def test_c_and_python_agree_on_motion(segments: list[Segment], sequence: int) -> None:
    packet = build(Motion(count=len(segments)), sequence, 0, segments)
    parsed = parse(packet)
    assert parsed is not None and list(parsed.segments) == segments
    assert rebuild(packet) == packet


@given(vector=st.sampled_from(VECTORS), data=st.data())
def test_damage_is_seen_by_both(vector: dict[str, Any], data: Any) -> None:
    """One or two wrong bits anywhere, or a cut end, and it is no packet. (This CRC finds all 2-bit errors.)"""
    packet = bytearray(bytes_of(vector))
    if data.draw(st.booleans()):
        packet = packet[: data.draw(st.integers(0, len(packet) - 1))]
    else:
        bits = data.draw(st.sets(st.integers(0, 8 * len(packet) - 1), min_size=1, max_size=2))
        for bit in bits:
            packet[bit // 8] ^= 1 << bit % 8
        if any(48 <= bit < 64 for bit in bits):
            return  # the length field: another stretch of bytes is summed up
    assert parse(bytes(packet)) is None
    assert not opens(bytes(packet))


@given(data=st.binary(max_size=512))
def test_any_bytes_are_looked_at_without_harm(data: bytes) -> None:
    assert (parse(data) is not None) <= opens(data)


def test_bytes_behind_a_packet_are_ignored() -> None:
    known = bytes_of(VECTORS[0])
    assert parse(known + b"xyz") is not None and opens(known + b"xyz")


def test_segments_that_do_not_fit_are_no_motion() -> None:
    packet = build(Motion(count=2), segments=[Segment()])
    assert parse(packet) is None


def test_all_published_keys_are_there_once() -> None:
    keys = {row.key + n for row in KEYS for n in range(row.count)}
    assert len(keys) == sum(row.count for row in KEYS) == 113
    ours = {0x0202, 0x0614, 0x0615, 0x0616, 0x0617, 0x0618, 0x0800, 0x0801, 0x0802}
    assert ours < keys, "the published ones are 104"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type = 0x02\n", "type = 0x01\n", "two packets have type 0x01"),
        ('repeat = "segment"', 'repeat = "step"', "there is no struct step"),
        ('["count", "u8", "", "1 .. 8"]', '["count", "u9", "", ""]', "no such type: u9"),
        ("key = 0x0101", "key = 0x0100", "is given twice"),
    ],
)
def test_a_wrong_table_is_refused(old: str, new: str, message: str) -> None:
    text = (ROOT / "protocol/wmc3.toml").read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(ValueError, match=message):
        parse_wire(text.replace(old, new, 1), load_settings(), load_nvs())
