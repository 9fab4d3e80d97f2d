"""Files become lines: what is sent, what stays, what is refused before anything is sent."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.errors import JobError
from wificnc.job.program import numbered, read_program, words_of


def sent(text: str | bytes) -> list[tuple[int, str]]:
    data = text if isinstance(text, bytes) else text.encode()
    return [(line.number, line.code) for line in read_program("job.nc", data).lines]


def test_lines_keep_their_numbers() -> None:
    text = "%\r\n(head)\r\n\r\ng1 x 1 ; there\r\nG0 (and) Y2 (back\r\n%\r\n"
    assert sent(text) == [(4, "G1X1"), (5, "G0Y2")]
    program = read_program("job.nc", text.encode())
    assert (program.file_lines, program.mark_lines) == (6, 2)
    assert program.lines[1].title == "line 5 (G0 (and) Y2 (back)"


@pytest.mark.parametrize("mark", ["O1000", "o0001 (BRACKET)", "N1 O7", ":1000", "N9%"])
def test_marks_of_the_program_stay_here(mark: str) -> None:
    """Another Grbl controller would refuse them; O words that jump are expanded, and never left out."""
    assert sent(f"{mark}\nG0 X1\n") == [(2, "G0X1")]
    assert sent(f"{mark} G0\nG0 X1\n")[0][0] == 1


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_line_ends(end: str) -> None:
    assert sent(f"G0 X1{end}{end}G0 X2{end}") == [(1, "G0X1"), (3, "G0X2")]


def test_marks_of_editors() -> None:
    assert sent(b"\xef\xbb\xbfG0 X1\nG0 X2\n\x1a") == [(1, "G0X1"), (2, "G0X2")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"G0 X1\nG1 X!1\n", "job.nc:2: ! (feed hold) is not G-code: G1 X!1"),
        (b"G0 X1?\n", "job.nc:1: ? (status) is not G-code"),
        (b"G0\x18 X1\n", "job.nc:1: Ctrl-X (reset) is not G-code: G0\\x18 X1"),
        (b"G0 X1\x85\n", "job.nc:1: byte 0x85 is not G-code"),
    ],
)
def test_real_time_bytes_in_code_are_refused(text: bytes, words: str) -> None:
    with pytest.raises(JobError) as error:
        read_program("job.nc", text)
    assert words in error.value.message


def test_nothing_to_send() -> None:
    with pytest.raises(JobError, match="has no G-code"):
        read_program("job.nc", b"(nothing)\n%\n")


@given(st.binary(max_size=300))
def test_no_real_time_byte_ever_gets_out(data: bytes) -> None:
    try:
        lines = read_program("job.nc", data).lines
    except JobError:
        return
    assert not set(b"!?~\x18") & {byte for line in lines for byte in line.wire}
    assert all(byte < 0x80 for line in lines for byte in line.wire)


def test_numbers_of_the_file_become_n_words() -> None:
    long = "G1" + "X1" * 38
    lines = read_program("job.nc", f"N10 G0 X1\n\n$H\nN9{long}\nG1 N77 Y2 (N7)\n".encode()).lines
    assert [line.code for line in numbered(lines)] == ["N1G0X1", "$H", long, "N5G1Y2"]


def test_words() -> None:
    assert words_of("G1X-.5Y+2.F1E3") == [("G", 1.0), ("X", -0.5), ("Y", 2.0), ("F", 1.0), ("E", 3.0)]
