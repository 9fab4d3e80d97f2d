"""Bytes -> lines against a model that is written from the rules and not from the C."""

from __future__ import annotations

import re
from ctypes import CDLL, byref, c_int

import pytest
from gcode_core import LINE_BROKEN, LINE_NONE, LINE_OVERFLOW, LINE_READY, LineReader
from hypothesis import given
from hypothesis import strategies as st

COMMENT = re.compile(rb"\([^)]*(\)|$)|;.*", re.DOTALL)
MAX = 256
OVERFLOW = BROKEN = None  # both are answered error:11
GAP = 0x18  # bytes were lost here

SPICY = st.lists(
    st.sampled_from(
        [
            b"G1",
            b"x2.5",
            b" ",
            b"\t",
            b"\n",
            b"\r",
            b"\r\n",
            b"(",
            b")",
            b";",
            b"/",
            b"[",
            b"#",
            b"\0",
            b"\x7f",
            b"\x80",
            b"\x18",
            b"q" * 30,
        ]
    )
    | st.binary(max_size=4),
    max_size=60,
).map(b"".join)


def model(stream: bytes) -> list[bytes | None]:
    """The finished lines of a stream; OVERFLOW for one that is too long, BROKEN for one of which bytes were lost."""
    return [_filtered(line) for line in re.split(rb"\r\n|\r|\n", stream)[:-1]]


def _filtered(line: bytes) -> bytes | None:
    if GAP in line:
        return BROKEN
    bare = COMMENT.sub(b"", line)
    kept = bytes(byte for byte in bare.upper() if 0x20 < byte < 0x80)
    plain = re.match(rb"[^\[#]*", kept)[0]  # behind the first [ or # a slash divides
    kept = plain.replace(b"/", b"") + kept[len(plain) :]
    return kept if len(kept) <= MAX else OVERFLOW


def put_all(lib: CDLL, stream: bytes) -> list[bytes | None]:
    """The lines by line_reader_put()."""
    reader, lines = LineReader(), []
    lib.line_reader_reset(byref(reader))
    for byte in stream:
        lines += _line(reader, lib.line_reader_put(byref(reader), byte))
    return lines


def take_all(lib: CDLL, chunks: list[bytes]) -> list[bytes | None]:
    """The lines by line_reader_take() of several buffers."""
    reader, lines, result = LineReader(), [], c_int()
    lib.line_reader_reset(byref(reader))
    for chunk in chunks:
        while chunk:
            taken = lib.line_reader_take(byref(reader), chunk, len(chunk), byref(result))
            assert 0 < taken <= len(chunk)
            assert result.value != LINE_NONE or taken == len(chunk)
            lines += _line(reader, result.value)
            chunk = chunk[taken:]
    return lines


def _line(reader: LineReader, result: int) -> list[bytes | None]:
    if result == LINE_NONE:
        return []
    if result in (LINE_OVERFLOW, LINE_BROKEN):
        return [OVERFLOW]
    assert result == LINE_READY
    assert reader.length == len(reader.text)
    return [reader.text]


@given(SPICY)
def test_put_follows_the_rules(lib: CDLL, stream: bytes) -> None:
    assert put_all(lib, stream) == model(stream)


@given(st.lists(SPICY, max_size=6))
def test_buffers_may_end_anywhere(lib: CDLL, chunks: list[bytes]) -> None:
    assert take_all(lib, chunks) == model(b"".join(chunks))


@pytest.mark.parametrize(
    ("rule", "stream", "lines"),
    [
        ("CR LF is one end", b"G0\r\n", [b"G0"]),
        ("LF CR are two ends", b"G0\n\r", [b"G0", b""]),
        ("CR, then a line, then LF are two ends", b"G0\rX1\n", [b"G0", b"X1"]),
        ("an empty line is a line", b"\n\n\r\r", [b"", b"", b"", b""]),
        ("CR LF CR LF are two ends", b"\r\n\r\n", [b"", b""]),
        ("a half line is no line", b"G0X1", []),
        ("letters are upper-cased, others are not", b"g0x`a{z}@[\n", [b"G0X`A{Z}@["]),
        ("block delete is dropped", b"/G0/X1\n", [b"G0X1"]),
        ("a comment runs to its ), nested or not", b"G0(a(b)X1)\n", [b"G0X1)"]),
        ("an open comment ends with its line", b"G0(a\nX1\n", [b"G0", b"X1"]),
        (") inside ; and ( inside ; mean nothing", b"G0;)X1(\nX2\n", [b"G0", b"X2"]),
        ("; inside ( ) means nothing", b"G0(;)X1\n", [b"G0X1"]),
        ("100 spaces are fine", b"G0" + b" " * 100 + b"X1\n", [b"G0X1"]),
        ("a 110-character comment is fine", b"G0(" + b"c" * 110 + b")X1\n", [b"G0X1"]),
        ("256 characters are stored", b"9" * 256 + b"\n", [b"9" * 256]),
        ("the 257th is too many", b"9" * 257 + b"\nX1\n", [OVERFLOW, b"X1"]),
        ("an overflow is not mended by a comment", b"9" * 257 + b"(c)\nX1\n", [OVERFLOW, b"X1"]),
        ("256 and a comment are fine", b"9" * 256 + b"(c);\n", [b"9" * 256]),
        ("an overflow ends with CR LF too", b"9" * 299 + b"\r\n\n", [OVERFLOW, b""]),
        ("bytes of UTF-8 vanish", "G0X1µ\n".encode(), [b"G0X1"]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_rule(lib: CDLL, rule: str, stream: bytes, lines: list[bytes | None]) -> None:
    assert model(stream) == lines, "the model"
    assert put_all(lib, stream) == lines
    assert take_all(lib, [stream]) == lines


def test_reset_forgets_a_half_line(lib: CDLL) -> None:
    reader = LineReader()
    lib.line_reader_reset(byref(reader))
    for half in (b"G0(comment", b"G0;comment", b"9" * 99, b"G0", b"G0\r"):
        for byte in half:
            lib.line_reader_put(byref(reader), byte)
        lib.line_reader_reset(byref(reader))
        assert reader.text == b""
        assert [lib.line_reader_put(byref(reader), byte) for byte in b"X1\n"] == [LINE_NONE, LINE_NONE, LINE_READY]
        assert reader.text == b"X1"


def test_a_line_stays_until_the_next_byte(lib: CDLL) -> None:
    reader, result = LineReader(), c_int()
    lib.line_reader_reset(byref(reader))
    assert lib.line_reader_take(byref(reader), b"G0\nX1\n", 6, byref(result)) == 3
    assert (result.value, reader.text) == (LINE_READY, b"G0")
    assert lib.line_reader_take(byref(reader), b"", 0, byref(result)) == 0
    assert (result.value, reader.text) == (LINE_NONE, b"G0")
