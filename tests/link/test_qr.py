"""QR codes of the firmware: those of segno, module for module; and read back as ISO/IEC 18004 says."""

from __future__ import annotations

import ctypes

import pytest
import segno
from c_library import LIB
from layouts import HOST

QUIET, ROW = 4, 3 * (37 + 2 * 4) + 1
UPPER, LOWER, FULL = "▀", "▄", "█"
DATA = {21: 19, 25: 34, 29: 55, 33: 80, 37: 108}  # table 7, level L: codewords of data by the modules of a side
FRAME = 2  # mode, length, terminator


def code(text: bytes) -> list[list[bool]]:
    """Dark modules, as read from the rows of text with their border."""
    qr = HOST.struct("net_qr")()
    assert LIB.net_qr_make(ctypes.byref(qr), text)
    row = ctypes.create_string_buffer(ROW)
    lines = []
    while LIB.net_qr_row(ctypes.byref(qr), len(lines), row):
        lines.append(row.value.decode())
    light = [[letter in half for letter in line] for line in lines for half in (UPPER + FULL, LOWER + FULL)]
    return [[not module for module in row] for row in light[: len(light[0])]]


@pytest.mark.parametrize("side", DATA)
def test_a_full_code_has_the_modules_of_another_encoder(side: int) -> None:
    """Full: segno adds a codeword of 0 before the padding, which the standard does not ask for."""
    text = bytes(33 + number % 90 for number in range(DATA[side] - FRAME))
    made = segno.make_qr(text, error="l", mask=0, mode="byte", boost_error=False)
    expected = [[module == 1 for module in row] for row in made.matrix_iter(border=QUIET)]
    assert len(expected) == side + 2 * QUIET and code(text) == expected


TEXTS = [
    b"",
    b"a",
    b"http://10.0.0.7/",
    b"http://192.168.100.100/",
    b"http://192.168.100.100/#key=k7qf3x2m9d0abcdefghj",
    b"\xff\x80",
    *(b"x" * size for size in (16, 18, 31, 33, 52, 54, 77, 79, 105)),
]


@pytest.mark.parametrize("text", TEXTS)
def test_a_code_reads_as_its_text_and_needs_no_correction(text: bytes) -> None:
    grid = [row[QUIET:-QUIET] for row in code(text)[QUIET:-QUIET]]
    words = codewords(grid)
    data = DATA[len(grid)]
    assert len(text) + FRAME <= data and min(size for size in DATA.values() if size >= len(text) + FRAME) == data
    nibbles = [nibble for word in words[:data] for nibble in (word >> 4, word & 15)]
    body = bytes(16 * high + low for high, low in zip(nibbles[1::2], nibbles[2::2], strict=False))
    assert nibbles[0] == 0b0100 and body[0] == len(text) and body[1 : 1 + len(text)] == text
    pads = words[len(text) + FRAME : data]
    assert pads == [(0xEC, 0x11)[number % 2] for number in range(len(pads))]
    assert all(value(words, root) == 0 for root in roots(len(words) - data))


def codewords(grid: list[list[bool]]) -> list[int]:
    """7.7.3 and mask 000."""
    side = len(grid)
    bits = [grid[y][x] ^ ((x + y) % 2 == 0) for x, y in places(side) if not has_pattern(side, x, y)]
    return [sum(bit << 7 - at for at, bit in enumerate(bits[i : i + 8])) for i in range(0, len(bits) // 8 * 8, 8)]


def places(side: int) -> list[tuple[int, int]]:
    columns = [*range(side - 1, 6, -2), 5, 3, 1]
    rows = [range(side - 1, -1, -1), range(side)]
    return [(x, y) for turn, right in enumerate(columns) for y in rows[turn % 2] for x in (right, right - 1)]


def has_pattern(side: int, x: int, y: int) -> bool:
    finders = (x < 9 and (y < 9 or y >= side - 8)) or (x >= side - 8 and y < 9)
    alignment = side > 21 and max(abs(x - side + 7), abs(y - side + 7)) <= 2
    return finders or alignment or 6 in (x, y)


def times(a: int, b: int) -> int:
    """In GF(256) by x^8 + x^4 + x^3 + x^2 + 1."""
    product = 0
    while b:
        product ^= a * (b & 1)
        a, b = (a << 1) ^ (0x11D * (a >> 7)), b >> 1
    return product


def roots(count: int) -> list[int]:
    found = [1]
    while len(found) < count:
        found.append(times(found[-1], 2))
    return found


def value(words: list[int], at: int) -> int:
    """Of the polynomial with these coefficients."""
    result = 0
    for word in words:
        result = times(result, at) ^ word
    return result


def test_what_is_too_long_is_refused() -> None:
    qr = HOST.struct("net_qr")()
    assert not LIB.net_qr_make(ctypes.byref(qr), b"x" * 107)
