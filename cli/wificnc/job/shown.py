"""Comments that a controller shows, as they are written in the file: on the wire they are ASCII, and values take the
place of parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from wificnc.connection.typed import COMMENT, MESSAGE, SHOWN, chosen_comment, kept_comment

VALUE = re.compile(r"#\d+|#<[^>]*>|%(?:d|lf|f|\.\df)")  # in PRINT and DEBUG
WITH_VALUES = re.compile(r"\s*(?:PRINT|DEBUG),", re.IGNORECASE)
SPECIAL = re.compile(r"[^\x20-\x7e]|[!?~]")  # does not get to a controller
MARK = re.compile(r"\{\{(\d+)\}\}")
SHOWN_MAX = 80  # LINE_COMMENT_SIZE of core/config.h
TOOL_CHANGE = re.compile(r"Tool change: T\d+ ")

Written = Callable[[str], str]


def as_written(lines: Iterable[tuple[str, str]]) -> Written:
    """What turns a message about a comment back into the file's words; any other message stays.

    Args:
        lines: of the file, each with its code.
    """
    words: dict[str, str] = {}
    patterns: list[tuple[re.Pattern[str], str]] = []
    for text, code in lines:
        comment = chosen_comment(text, code)
        if not SPECIAL.search(comment):
            continue
        sent = MESSAGE.sub("", kept_comment(text, code)[1:-1]).strip()[:SHOWN_MAX]
        shown, written = sent.replace("[", "(").replace("]", ")").replace("|", "/"), MESSAGE.sub("", comment).strip()
        words[shown] = written
        if WITH_VALUES.match(comment) and VALUE.search(shown):
            patterns.append((re.compile("(.+?)".join(map(re.escape, VALUE.split(shown)))), written))

    def restore(message: str) -> str:
        before = found[0] if (found := TOOL_CHANGE.match(message)) else ""
        shown = message[len(before) :]
        if shown in words:
            return before + words[shown]
        for pattern, written in patterns:
            if match := pattern.fullmatch(shown):
                values = iter(match.groups())
                return VALUE.sub(lambda _, values=values: next(values, ""), written)  # type: ignore[misc]
        return message

    return restore


def marked(lines: Iterable[str]) -> tuple[list[str], Written]:
    """Lines whose comments a simulated controller takes, and what turns its messages back into the file's words.

    What is meant for the operator begins with a mark, so is_comment() finds it among the messages.
    """
    pieces: list[str] = []

    def mark_of(bare: str) -> str:
        pieces.append(bare)
        return f"{{{{{len(pieces) - 1}}}}}"

    def mark(piece: str, always: bool) -> str:
        bare = piece.strip()
        return piece.replace(bare, mark_of(bare)) if (bare and always) or SPECIAL.search(bare) else piece

    def of_comment(match: re.Match[str], shown: bool) -> str:
        opening, inner = match[0][0], match[0][1:].removesuffix(")" if match[0][0] == "(" else "")
        begin = found[0] if (found := MESSAGE.match(inner)) else ""
        body = inner[len(begin) :]
        if WITH_VALUES.match(begin):
            first, *others = VALUE.split(body)
            values = VALUE.findall(body)
            marks = [mark(first, True) if first.strip() else mark_of(""), *(mark(piece, False) for piece in others)]
            body = "".join(piece + value for piece, value in zip(marks, [*values, ""], strict=True))
        else:
            body = mark(body, shown or bool(begin))
        return opening + begin + body + (")" if opening == "(" else "")

    found = []
    for line in lines:
        shown = SHOWN.search(line.upper()) is not None
        found.append(COMMENT.sub(lambda match, shown=shown: of_comment(match, shown), line))  # type: ignore[misc]
    return found, lambda message: MARK.sub(lambda match: _piece(pieces, match), message)


def is_comment(message: str) -> bool:
    """A message of marked() lines that the program wrote, not the controller."""
    return MARK.match(message) is not None


def _piece(pieces: list[str], match: re.Match[str]) -> str:
    number = int(match[1])
    return pieces[number] if number < len(pieces) else match[0]
