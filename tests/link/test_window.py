"""Character counting, without a controller."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st
from wificnc.connection.character_counting import Streamer


@dataclass(frozen=True)
class Line:
    wire: bytes
    alone: bool = False


LINES = st.lists(st.integers(1, 79).map(lambda size: Line(b"x" * size + b"\n")), max_size=40)


@given(LINES, st.integers(80, 300), st.data())
def test_never_more_under_way_than_the_buffer_takes(lines: list[Line], capacity: int, data: st.DataObject) -> None:
    streamer = Streamer(lines, capacity)
    wire, answered = b"", []
    while not streamer.done:
        wire += streamer.take()
        under_way = sum(len(line.wire) for line in streamer.under_way)
        assert under_way == streamer.window.under_way <= capacity
        for _ in range(data.draw(st.integers(1, len(streamer.under_way)))):
            answered.append(streamer.answer())
    assert wire == b"".join(line.wire for line in lines)
    assert answered == lines
    assert streamer.answer() is None


@given(LINES, st.integers(0, 127))
def test_never_more_than_the_free_bytes_reported(lines: list[Line], free: int) -> None:
    streamer = Streamer(lines, 128)
    before = streamer.take()
    streamer.window.hear_free(free)
    streamer.answer()
    after = streamer.take()
    assert streamer.window.under_way <= max(len(before), free + len(before))
    assert not after or streamer.window.under_way <= free + len(before)


def test_somebody_elses_bytes_in_the_buffer() -> None:
    streamer = Streamer([Line(b"x" * 49 + b"\n")] * 3, 128)
    streamer.window.hear_free(60)  # nothing of ours is under way, and yet only 60 are free
    assert len(streamer.take()) == 50
    streamer.window.hear_free(78)  # now it is all ours
    assert len(streamer.take()) == 50


def test_line_that_must_be_alone() -> None:
    streamer = Streamer([Line(b"G0\n"), Line(b"$H\n", True), Line(b"G1\n")], 128)
    assert streamer.take(at_rest=True) == b"G0\n"
    assert streamer.take(at_rest=True) == b""
    streamer.answer()
    assert streamer.waits_for_rest
    assert streamer.take(at_rest=False) == b""
    assert streamer.take(at_rest=True) == b"$H\n"
    assert streamer.take(at_rest=True) == b""
    streamer.answer()
    assert streamer.take() == b"G1\n"
