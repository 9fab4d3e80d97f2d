"""Lines that people and scripts write, on their way to a controller.

Every byte from 0x80 on, and `!`, `?`, `~` and Ctrl-X, is a real-time command wherever it is in a line: the UTF-8 of
one letter in a comment would open the safety door. Comments stay here; anything else of this kind is refused.
"""

from __future__ import annotations

import re

from wificnc.errors import UserError

COMMENT = re.compile(r"\([^)]*\)|\(.*$|;.*$")
COMMANDS = {"!": "feed hold", "~": "resume", "?": "status report"}


def typed_line(text: str) -> bytes:
    """The line without its comments, with its end. Raises UserError: it holds what would act as a command."""
    return wire_line(COMMENT.sub("", text))


def wire_line(line: str) -> bytes:
    """The bytes of a line, with its end. Raises UserError."""
    for character in line:
        if why := _why_not(character):
            raise UserError(f"{why} anywhere in a line; nothing was sent of {line!r}")
    return line.encode("ascii") + b"\n"


def _why_not(character: str) -> str:
    if character in COMMANDS:
        return f'{character} is the command "{COMMANDS[character]}"'
    if character.isascii() and (character.isprintable() or character == "\t"):
        return ""
    return f"{character!r} is not printable ASCII, and a controller reads its bytes as commands"
