"""Files that are no G-code: each command says what is wrong, and runs nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

Cli = Callable[..., tuple[int, str, str]]

COMMANDS = {
    "sim": ("sim", "{file}"),
    "check": ("check", "{file}", "--machine", "baseline"),
    "expand": ("expand", "{file}", "-o", "-"),
    "send": ("send", "{file}", "--to", "tcp://127.0.0.1:1"),
}
FILES = {
    "empty": (b"", "is empty"),
    "blanks": (b" \n\t\r\n", "is empty"),
    "comments": (b"(head)\n; all\n  (of) (it)\n", "has no G-code"),
    "percent": (b"%\n%\n", "has no G-code"),
    "utf-16": ("G0X1\n".encode("utf-16"), "is written in UTF-16"),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x01\0\0\0\x01\0\x08", "is not a text file"),
    "zip": (b"PK\x03\x04\x14\0\x08\0\x08\0G0X1\n", "is not a text file"),
}
GOOD = {
    "crlf and a byte order mark": b"\xef\xbb\xbfG0X1\r\nG0X2\r\n",
    "a whole tape": b"\0\0\0%\r\nO1000 (PART)\r\nG0X1\r\nG0X2\r\n%\r\n\0\0\x1a",
    "carriage returns": b"G0X1\rG0X2\r",
    "code after a comment": b"(a) (b) G0X1\n(c)G0X2 ; d\n",
    "no end of line": b"G0X1\nG0X2",
    "a comment in another code": b"(Stra\xdfe)\nG0X1\nG0X2\n",
    "form feeds": b"\fG0X1\n\v G0\fX2\f\n\f\n",
}
# One line of code that no command takes, whatever it does with the file.
REFUSED = {
    "a minus of typography": ("G1X\u22125".encode(), "byte 0xE2 is not G-code"),
    "a blank that does not break": ("G1\xa0X5".encode(), "byte 0xC2 is not G-code"),
    "a line separator": ("G1X5\u2028G1X6".encode(), "byte 0xE2 is not G-code"),
    "a feed hold": (b"G1X5!", "! (feed hold) is not G-code"),
    "a status request": (b"?", "? (status) is not G-code"),
    "a bracket within a comment": (b"(a (b) c)", "a comment ends at its first )"),
    "a bracket alone": (b")", "a comment ends at its first )"),
    "check mode": (b"$C", "$C switches check mode"),
    "escape": (b"\x1b[31mG1X5", "byte 0x1B is not G-code"),
    "delete": (b"G1X5\x7f", "byte 0x7F is not G-code"),
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", FILES)
def test_no_job(cli: Cli, tmp_path: Path, command: str, kind: str) -> None:
    content, words = FILES[kind]
    file = tmp_path / "job.nc"
    file.write_bytes(content)
    code, out, err = cli(*(word.format(file=file) for word in COMMANDS[command]))
    assert (code, out) == (1, "") and f"job.nc {words}" in err


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("file", ["missing.nc", "folder"])
def test_no_file(cli: Cli, tmp_path: Path, command: str, file: str) -> None:
    (tmp_path / "folder").mkdir()
    code, out, err = cli(*(word.format(file=tmp_path / file) for word in COMMANDS[command]))
    assert (code, out) == (1, "")
    assert ("file not found" if file == "missing.nc" else "is a folder, not a G-code file") in err


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", REFUSED)
def test_a_line_that_is_no_code(cli: Cli, tmp_path: Path, command: str, kind: str) -> None:
    content, words = REFUSED[kind]
    file = tmp_path / "job.nc"
    file.write_bytes(b"F100\n" + content + b"\nG0X1\n")
    code, out, err = cli(*(word.format(file=file) for word in COMMANDS[command]))
    assert (code, out) == (1, "") and f"job.nc:2: {words}" in err


@pytest.mark.parametrize("command", ["sim", "check", "expand"])
@pytest.mark.parametrize("kind", GOOD)
def test_a_job(cli: Cli, tmp_path: Path, command: str, kind: str) -> None:
    file = tmp_path / "job.nc"
    file.write_bytes(GOOD[kind])
    code, out, err = cli(*(word.format(file=file) for word in COMMANDS[command]))
    assert code == 0, err
    if command == "expand":
        assert out == "G0X1\nG0X2\n"
    elif command == "sim":
        assert " 2 moves" in out
