r"""Letters of UTF-8 in the lines of any sender: text in a comment, an error in code, and never a command."""

from __future__ import annotations

import pytest
from c_library import LIB
from grbl_host import Grbl


def raw(text: str) -> str:
    """The bytes of UTF-8, as the harness sends bytes."""
    return text.encode().decode("latin-1")


def reported(grbl: Grbl) -> set[str]:
    """State, overrides and what is on, as far as some reports have them."""
    reports = [grbl.status() for _ in range(25)]
    fields = (field for report in reports for field in report.strip("<>\r\n").split("|"))
    return {field for field in fields if not field.startswith(("MPos", "WCO", "FS"))}


@pytest.mark.parametrize(
    "comment",
    [
        "(Größe 6 × 4 mm, Äußeres)",
        "; Ä Å Ç È É Ê Ë Ì Í Î Ï Ð Ñ Ò",
        "(ð ñ ò ó ô õ ö ÷ ø ù ú û)",
        "(深さ − ≥ ½ “Ä” €)",
        "(\U0001f527 \U0001f6d1 Ä)",
        *(f"({chr(first + at)})" for first in (0xC0, 0x400, 0x2000) for at in range(0, 64, 3)),
    ],
)
def test_letters_in_a_comment_act_as_nothing(grbl: Grbl, comment: str) -> None:
    assert grbl.send(raw(f"G0X31 {comment}\n")) == "ok\r\n"
    assert reported(grbl) == {"Idle", "Ov:100,100,100"}
    assert grbl.position()[0] == 31 * 250


@pytest.mark.parametrize("line", ["G0X−5", "G0X5Ä", "ÄG0X5", "G0X5×2", "$J=G91X−5F100", "G0X5\u00a0Y1", "$110=−5"])
def test_letters_in_code_are_refused(grbl: Grbl, line: str) -> None:
    """The line would be another one without them: a Unicode minus moves the other way."""
    assert grbl.send(raw(line + "\n")).startswith("error:")
    assert grbl.position()[:2] == [0, 0] and grbl.state() == "Idle"


@pytest.mark.parametrize("bytes_", ["\x91", "\x96", "\x9b", "\xa0", "\x84"])
def test_commands_alone_still_act(grbl: Grbl, bytes_: str) -> None:
    """After anything but the first byte of a letter; also in a comment, and after a whole letter."""
    grbl.after(0.3, "$J=G91X-50F1000\n")
    said = grbl.send(raw("(Ä") + "\x85")
    assert grbl.state() == "Idle" and -50 * 250 < grbl.position()[0] < 0
    assert grbl.send(")\n") == "ok\r\n"
    assert said.count("error") == 0
    before = reported(grbl)
    grbl.send(raw("(ü") + bytes_)
    assert reported(grbl) != before


def test_a_letter_that_is_cut_keeps_one_byte_at_most(grbl: Grbl) -> None:
    """Its rest comes with the next packet; a command in its place is text, the one after it acts, and so do ! and
    Ctrl-X immediately."""
    grbl.after(0.3, "$J=G91X-50F1000\n")
    grbl.send("(\xc3\x85")
    assert grbl.state() == "Idle" and grbl.position()[0] == -50 * 250, "that jog was not cancelled"
    assert grbl.send(")\n") == "ok\r\n"
    for cancel in ("(\xc3\x84\x85", "(\xe2!", "(\xf0\x9f\x1b\x85"):
        before = grbl.position()[0]
        grbl.after(0.3, "$J=G91X50F1000\n")
        grbl.send(cancel)
        assert grbl.state() == "Idle" and before < grbl.position()[0] < before + 50 * 250
        assert grbl.send(")\n") == "ok\r\n"


@pytest.mark.parametrize("bytes_", ["\xc0", "\xc1", "\xf5", "\xfe", "\xff"])
def test_bytes_that_begin_no_letter_keep_no_command(grbl: Grbl, bytes_: str) -> None:
    assert grbl.send(bytes_ + "\x84") == "[MSG:Check Door]\r\n" and grbl.state() == "Door:0"


def test_a_letter_is_not_lost_where_there_is_no_room() -> None:
    """Its bytes come again, as TCP sends them, until the controller takes them: its line is refused as ever."""
    grbl = Grbl()
    grbl.send("")
    while LIB.host_write(grbl._host, b"\n", 1):
        pass
    first, *rest = (bytes([byte]) for byte in "\uff0dG0X5\n".encode())
    assert LIB.host_write(grbl._host, first, 1) == 1, "it begins a letter, and takes no room yet"
    assert [LIB.host_write(grbl._host, rest[0], 1) for _ in range(3)] == [0, 0, 0]
    answers = grbl.after(1.0, "")
    for byte in rest:
        assert LIB.host_write(grbl._host, byte, 1) == 1
    assert (answers + grbl.after(1.0, "")).endswith("ok\r\nerror:1\r\n")
    assert grbl.position()[0] == 0
    grbl.close()
