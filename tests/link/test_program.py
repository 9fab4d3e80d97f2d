"""Files become lines: what is sent, what stays, what is refused before anything is sent."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.commands.send import job_program
from wificnc.connection.typed import typed_line
from wificnc.errors import JobError, UserError
from wificnc.job.program import longest_line, read_program, ready, words_of


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
    assert [line.code for line in ready(lines)] == ["N1G0X1", "$H", long, "N5G1Y2"]


def test_words() -> None:
    assert words_of("G1X-.5Y+2.F1E3") == [("G", 1.0), ("X", -0.5), ("Y", 2.0), ("F", 1.0), ("E", 3.0)]


def test_comments_stay_without_numbers_too() -> None:
    """What stays is in test_comments.py."""
    (line,) = ready(read_program("job.nc", b"T2 M6 (drill)\n").lines, numbered=False)
    assert line.wire == b"T2M6(drill)\n"


@pytest.mark.parametrize("text", ["G10 L1 P2 Z1 (6 mm!)", "G10 L1 P2 Z1 (Fräser)", "G10 L1 P2 Z1 (" + "x" * 300 + ")"])
def test_a_tools_text_that_cannot_be_sent_is_refused(text: str) -> None:
    with pytest.raises(JobError, match=r"job.nc:2: (a tool's text has letters|more than 256)"):
        read_program("job.nc", f"G21\n{text}\n".encode())


def test_a_long_tools_text_goes_where_lines_may_be_long() -> None:
    """Ours take 256 characters; for others the file is refused before anything is sent."""
    text = "G10 L1 P2 Z1 (" + "x" * 100 + ")"
    lines = read_program("job.nc", text.encode()).lines
    (line,) = ready(lines, longest=longest_line(1024))
    assert line.wire == b"N1G10L1P2Z1(" + b"x" * 100 + b")\n"
    with pytest.raises(JobError, match="takes 79 characters"):
        ready(lines, longest=longest_line(128))


def test_latin_1_in_a_comment_stays_here() -> None:
    assert ready(read_program("job.nc", b"T1 M6 (Fr\xe4ser)").lines)[0].wire == b"N1T1M6(Fraser)\n"


def test_a_typed_line_keeps_its_blanks() -> None:
    assert typed_line("T2 M6 (drill) ; 1") == b"T2 M6  (drill)\n"


def test_a_typed_text_of_a_tool_with_a_command_is_refused() -> None:
    with pytest.raises(UserError, match="feed hold"):
        typed_line("G10 L1 P2 Z1 (6 mm!)")


def test_messages_of_a_program_with_o_words_have_its_values() -> None:
    """The controller has none of its parameters, and would show others; where the machine is, it alone knows."""
    text = b"#1=5\no1 repeat [2]\nG0X1 (PRINT,x=#1)\no1 endrepeat\nG0X2 ; debug, #<_x>\nG0X3 (MSG,#1)\n"
    comments = [line.comment for line in job_program("job.nc", text, 1000).lines if line.comment]
    assert comments == [b"(PRINT,x=5.000000)"] * 2 + [b"(debug, #<_x>)", b"(MSG,#1)"]


def test_a_line_with_a_message_alone_is_sent() -> None:
    lines = read_program("job.nc", b"(start)\n(MSG, turn it over)\nG0X1\n(done, it is)\n").lines
    assert [line.wire for line in ready(lines)] == [b"N2(MSG, turn it over)\n", b"N3G0X1\n"]
