"""How a file becomes lines on the wire."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim_native import job_lines, program_end
from wificnc.simulator.job import split_lines

BLANKS = b" \t\v\f"  # that a controller leaves out


@pytest.mark.parametrize(
    ("text", "lines", "numbers"),
    [
        (b"", [], []),
        (b"G0X1", [b"G0X1"], [1]),
        (b"G0X1\nG0X2\n", [b"G0X1", b"G0X2"], [1, 2]),
        (b"a\r\nb\rc\n\rd", [b"a", b"b", b"c", b"", b"d"], [1, 2, 3, 4, 5]),
        (b"\n\n", [b"", b""], [1, 2]),
        (b"%\nG0\n  % end\n", [b"G0"], [2]),
        (b"\xef\xbb\xbfG0\n", [b"G0"], [1]),
        (b"G0\r\n\x1a", [b"G0"], [1]),
        (b"(caf\xc3\xa9 ! ~ ? \x18) G0", [b"(caf    ) G0"], [1]),
        (b"G0 ; \x85!\nX1!", [b"G0 ; ", b'X1"'], [1, 2]),
        (b"X1\x000 Y\xff2\x18", [b'X1"0 Y"2"'], [1]),
        (b"(a;b) ! ;(c\n!", [b'(a;b) " ;(c', b'"'], [1, 2]),
        (b"G0\tX1", [b"G0\tX1"], [1]),
        (b"\fG0\vX1\n\f%\n", [b"\fG0\vX1"], [1]),
    ],
)
def test_lines(library, text, lines, numbers):
    wire, found, file_lines, percent = job_lines(library, text)
    assert (wire, found) == (lines, numbers)
    assert file_lines == len(lines) + percent


@given(st.binary(max_size=200))
def test_any_bytes_make_harmless_lines_that_people_count_alike(library, text):
    wire, numbers, _, percent = job_lines(library, text)
    end = program_end(library, text).line or len(text)
    shown = split_lines(text.rstrip(b"\x1a"))
    shown = shown[:-1] if not shown[-1] else shown
    marks = [line.lstrip(BLANKS).startswith(b"%") for line in shown]
    assert percent == sum(marks)
    assert numbers == [number for number, mark in enumerate(marks, 1) if not mark and number <= end]
    for line, number in zip(wire, numbers, strict=True):
        assert all(byte in BLANKS or (32 <= byte < 127 and byte not in b"!?~") for byte in line)
        assert not shown[number - 1].lstrip(BLANKS).startswith(b"%")
