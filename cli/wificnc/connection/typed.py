"""Lines that people and scripts write, on their way to a controller.

Every byte from 0x80 on, and `!`, `?`, `~` and Ctrl-X, is a real-time command wherever it is in a line: the UTF-8 of
one letter in a comment would open the safety door. Comments stay here, but for those that the controller keeps or
shows; anything else of this kind is refused.
"""

from __future__ import annotations

import re
import unicodedata

from wificnc.errors import UserError

COMMENT = re.compile(r"\([^)]*\)|\(.*$|;.*$")
TOOL_ROW = re.compile(r"(?:N[0-9.]+)?G10(?![0-9]).*L1(?![0-9])")  # its comment is the tool's text
SHOWN = re.compile(r"M(?:0*[16]|0+)(?![0-9.])")  # M0, M1, M6: their comment is in a message
MESSAGE = re.compile(r"\s*(?:MSG|PRINT|DEBUG),", re.IGNORECASE)  # a comment for the operator
BRACKETS = str.maketrans("()", "[]")  # the controller shows them as round ones
NOT_IN_A_COMMENT = re.compile(r"[^ -~]|[!?~]")
COMMANDS = {"!": "feed hold", "~": "resume", "?": "status report"}


def typed_line(text: str) -> bytes:
    """The line without its comments, but for what the controller keeps of them, with its end.

    Raises UserError: it holds what would act as a command.
    """
    bare = COMMENT.sub("", text)
    wire_line(bare)  # what is not a comment is refused first
    return wire_line(bare + kept_comment(text, "".join(bare.split()).upper()))


def kept_comment(text: str, code: str) -> str:
    """What the controller keeps or shows of a line's comments, in one pair of brackets: a tool's text (G10 L1), the
    comment of a pause (M0, M1) or a tool change (M6), and in any line one that begins with MSG, PRINT, or DEBUG, It is
    that in brackets, or else that behind a semicolon. A tool's text is as it is written, fit to be sent or not; what is
    only shown is in ASCII.

    Args:
        code: the line without blanks and comments, upper case.
    """
    comments = chosen_comment(text, code)
    if not TOOL_ROW.match(code):  # wide brackets become plain ones, which must not end the comment: so this comes first
        comments = NOT_IN_A_COMMENT.sub("", unicodedata.normalize("NFKD", comments)).strip()
    comments = comments.translate(BRACKETS)
    return f"({comments.strip() or ' '})" if comments else ""


def chosen_comment(text: str, code: str) -> str:
    """The same as it is written, without brackets; "": nothing."""
    is_row = TOOL_ROW.match(code)
    found = COMMENT.findall(text)
    messages = [] if is_row else [each for each in found if MESSAGE.match(each[1:])]
    if not is_row and not messages and (code.startswith("$") or not SHOWN.search(code)):
        return ""
    bracketed = [each for each in found if each[0] == "("]
    parts = (each[1:].removesuffix(")") if each[0] == "(" else each[1:] for each in messages or bracketed or found)
    return "".join(parts)


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
