"""The short ways of a plain line: they must mean what the long ways mean."""

from __future__ import annotations

import ctypes

import pytest
from gcode_core import LINE_READY, XYZABC, Controller, LineReader
from hypothesis import given
from hypothesis import strategies as st

NUMBERS = st.sampled_from(
    ["0", "1", "-2.5", "+3", ".5", "7.", "12.345", "-0", "99999", "100000.5", "1e5", "", "-", "1.2.3"]
)
WORDS = st.tuples(st.sampled_from("XYZABCFNGMSTPxR"), NUMBERS).map("".join)
CODES = st.sampled_from(["G0", "G1", "G01", "G1.0", "G2", "G53", "G91", "M3", "G93", "G38.2", "G80", "G1G0"])
PIECES = st.one_of(WORDS, CODES, st.sampled_from([" ", "  ", "\t", "(c)", ";c", "/", "1", "\x80"]))
LINES = st.lists(PIECES, max_size=6).map("".join)
BEFORE = st.lists(
    st.sampled_from(
        ["G1", "F100", "F0", "G20", "G91", "G10L2P1X1Y2Z3A4", "G92X5", "G43.1Z2", "G55", "X1.5A7", "G3", "G61", "M4S5"]
    ),
    max_size=5,
)


def controller(lib: ctypes.CDLL, before: list[str]) -> Controller:
    cnc = Controller(lib, XYZABC)
    for line in before:
        cnc.answer(line)
    return cnc


def filtered(lib: ctypes.CDLL, text: bytes) -> bytes:
    """The line as the line reader stores it; text ends at its LF or CR."""
    reader = LineReader()
    results = [lib.line_reader_put(ctypes.byref(reader), byte) for byte in text]
    assert results[-1] == LINE_READY
    return bytes(reader.text)


@given(before=BEFORE, line=LINES, end=st.sampled_from(["\n", "\r\n", " \n"]))
def test_a_plain_line_is_what_the_filter_makes_of_it(lib: ctypes.CDLL, before: list[str], line: str, end: str) -> None:
    cnc = controller(lib, before)
    text = (line + end).encode("latin-1")
    state = bytes(cnc.state)
    length, plain = cnc.plain(text)
    assert bytes(cnc.state) == state
    if length is None:
        return
    assert text[length] in b"\r\n" and not any(byte in b"\r\n" for byte in text[:length])
    status, command = cnc.resolve(filtered(lib, text[: length + 1]))
    assert status == 0
    assert bytes(command) == bytes(plain)


@pytest.mark.parametrize(
    "line", ["G1X2Y3F100", "G1 X12.345 Y-6.789 F1500", "X1  Y2 ", "N5 G0 Z1", "G54", "M3 S100", "F7"]
)
def test_a_line_of_a_job_is_plain(cnc: Controller, line: str) -> None:
    cnc.run("G1F100")
    for end in ("\n", "\r\n"):
        assert cnc.plain((line + end).encode())[0] == len(line)


@pytest.mark.parametrize(
    "line",
    [
        "",
        " ",
        "x1",
        "X 1",
        "X1 2",
        "X1 .5",
        "X1(c)",
        "X1;c",
        "/X1",
        "\tX1",
        "X1\x80",
        "$X",
        "X",
        "X1X2",
        "G5.5",
        "N1O2",
        "A1",
    ],
)
def test_other_lines_are_not(cnc: Controller, line: str) -> None:
    assert cnc.plain((line + "\n").encode("latin-1"))[0] is None


@given(before=BEFORE, words=st.lists(WORDS, max_size=4).map("".join), code=st.sampled_from(["", "G0", "G1"]))
def test_the_short_way_of_a_straight_move(lib: ctypes.CDLL, before: list[str], words: str, code: str) -> None:
    """G40 is the mode there is always: it changes nothing but the way through the resolver."""
    cnc = controller(lib, before)
    short, command = cnc.resolve(code + words)
    long, other = cnc.resolve(code + "G40" + words)
    assert short == long
    if short == 0:
        assert bytes(command) == bytes(other)


# -- line_reader_whole()


def whole(lib: ctypes.CDLL, taken: bytes, waiting: bytes) -> int | None:
    """Where the line begins in what waits, after taken was read byte by byte."""
    reader = LineReader()
    for byte in taken:
        lib.line_reader_put(ctypes.byref(reader), byte)
    buffer = ctypes.create_string_buffer(waiting, len(waiting))
    start = ctypes.addressof(buffer)
    line = lib.line_reader_whole(ctypes.byref(reader), start, len(waiting))
    return None if line is None else line - start


def test_a_whole_line_is_seen(lib: ctypes.CDLL) -> None:
    assert whole(lib, b"", b"G0X1\nG0") == 0
    assert whole(lib, b"G1\n", b"G0X1\r\n") == 0
    assert whole(lib, b"G1\r", b"\nG0X1\r\n") == 1, "the LF belongs to the line before"
    assert whole(lib, b"", b"X" * 79 + b"\n") == 0


def test_anything_else_is_not(lib: ctypes.CDLL) -> None:
    assert whole(lib, b"", b"") is None
    assert whole(lib, b"", b"G0X1") is None
    assert whole(lib, b"G", b"0X1\n") is None
    assert whole(lib, b"(", b"G0X1\n") is None
    assert whole(lib, b"G1\r", b"\n") is None
    assert whole(lib, b"", b"X" * 257 + b"\n") is None


def test_a_passed_line_counts_as_read(lib: ctypes.CDLL) -> None:
    """CR LF is one end, whoever read the line."""
    for end, answers in ((b"\r", [0, 1]), (b"\n", [1])):
        reader = LineReader()
        lib.line_reader_pass(ctypes.byref(reader), end[0])
        assert [lib.line_reader_put(ctypes.byref(reader), byte) for byte in b"\n\n"[: len(answers)]] == answers
