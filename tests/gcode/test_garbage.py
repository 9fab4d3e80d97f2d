"""Whatever arrives: no crash, a known answer, no effect of a refused line, no number that could not be meant."""

from __future__ import annotations

import math
from collections.abc import Iterable
from ctypes import CDLL, byref, c_int

from gcode_core import LINE_READY, NO_MOTION, XYZABC, Command, Controller, LineReader, status_table
from hypothesis import given, settings
from hypothesis import strategies as st

ANSWERS = set(status_table())
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
CODES = (
    "G0 G1 G2 G3 G4 G10 G17 G18 G19 G20 G21 G28 G28.1 G38.2 G43.1 G49 G53 G55 G64 G80 G90 G90.1 G91 G92 G93 G94 M3 M30"
)

WORD = st.builds(
    lambda letter, number: f"{letter}{number:.3f}",
    st.sampled_from("XYZABCIJKRFSTPLN"),
    st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1.0, 2.0, 20.0, 1e5, 1e9, 1e17]),
)
LINE = st.lists(st.sampled_from(CODES.split(" ")) | WORD, min_size=1, max_size=7).map("".join)


def assert_sane(cnc: Controller, line: str | bytes) -> int:
    """The answer to a line, after looking at everything that must hold whatever it is."""
    before = bytes(cnc.state)
    status, command = cnc.resolve(line)
    assert bytes(cnc.state) == before, "resolving changes nothing"
    assert status in ANSWERS
    if status == 0:
        _assert_sane_command(command)
    return status


def assert_in_range(coordinates: Iterable[float]) -> None:
    """100 m; 10 million turns."""
    for axis, coordinate in zip("XYZABC", coordinates, strict=True):
        assert abs(coordinate) <= (1e5 if axis in "XYZ" else 3.6e9)


def _assert_sane_command(command: Command) -> None:
    move, modal = command.move, command.next
    assert math.isfinite(modal.feed_mm_s) and modal.feed_mm_s >= 0
    assert math.isfinite(modal.spindle_rpm) and modal.spindle_rpm >= 0
    assert math.isfinite(command.dwell_s)
    assert 0 <= modal.tool <= 255
    assert modal.wcs < 6
    assert command.store_wcs < 6
    if command.store:
        assert_in_range(command.store_mm)
    if move.motion != NO_MOTION:
        assert_in_range(move.target_mm)
        assert_in_range(move.via_mm)
        assert move.feed_mm_s >= 0 and math.isfinite(move.feed_mm_s)
        assert move.inverse_time_s >= 0 and math.isfinite(move.inverse_time_s)
        assert all(math.isfinite(value) for value in move.center_mm)


@given(st.binary(max_size=200))
def test_any_bytes(lib: CDLL, stream: bytes) -> None:
    cnc, reader, result = Controller(lib, XYZABC), LineReader(), c_int()
    lib.line_reader_reset(byref(reader))
    while stream:
        stream = stream[lib.line_reader_take(byref(reader), stream, len(stream), byref(result)) :]
        if result.value == LINE_READY:
            assert_sane(cnc, reader.text)


@given(st.binary(max_size=300).filter(lambda line: 0 not in line))
def test_any_text_of_any_length(lib: CDLL, line: bytes) -> None:
    assert_sane(Controller(lib, XYZABC), line)


@given(st.text(LETTERS + "0123456789.+-", max_size=79))
def test_anything_that_looks_like_words(lib: CDLL, line: str) -> None:
    assert_sane(Controller(lib, XYZABC), line)


@settings(max_examples=300)
@given(st.lists(LINE, max_size=12))
def test_programs_of_good_and_bad_lines(lib: CDLL, lines: list[str]) -> None:
    """A program with its refused lines is the program without them."""
    mixed, clean = Controller(lib, XYZABC), Controller(lib, XYZABC)
    for line in lines:
        if assert_sane(mixed, line) == 0:
            mixed.run(line)
            clean.run(line)
    assert bytes(mixed.state) == bytes(clean.state)
