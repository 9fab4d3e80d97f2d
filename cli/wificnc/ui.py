"""The only module that talks to the terminal: data goes to stdout, talk to stderr."""

from __future__ import annotations

import codecs
import io
import json
import os
import sys
from contextlib import suppress
from typing import Any

from rich.console import Console
from rich.markup import escape

from wificnc.errors import UserError

talk = Console(stderr=True, highlight=False)
data = Console(highlight=False, soft_wrap=True)


# What a terminal without UTF-8 gets for the characters that we use; ? for all others.
PLAIN = {
    "²": "2", "³": "3", "µ": "u", "°": " deg", "±": "+-", "×": "x", "·": "*", "…": "...", "–": "-", "—": "-", "→": "->",
    "←": "<-", "≤": "<=", "≥": ">=", "■": "#", "●": "*", "✓": "ok", "✗": "x", "−": "-", "\u00a0": " ",
    "“": '"', "”": '"',
}  # fmt: skip
PLAIN_HANDLER = "wificnc.plain"


def use_plain_characters() -> None:
    """A locale without UTF-8 does not stop anything: what it cannot show is written in ASCII. So is a file's name
    that is not in UTF-8."""
    codecs.register_error(PLAIN_HANDLER, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and (stream.errors == "strict" or not _is_utf8(stream.encoding)):
            stream.reconfigure(errors=PLAIN_HANDLER)


def _plain(err: UnicodeError) -> tuple[str, int]:
    if not isinstance(err, UnicodeEncodeError):
        raise err
    return "".join(PLAIN.get(character, "?") for character in err.object[err.start : err.end]), err.end


def _is_utf8(encoding: str) -> bool:
    return encoding.lower().replace("-", "").replace("_", "") == "utf8"


def flush() -> None:
    """What was printed is out. Raises OSError: a full disk, a closed pipe."""
    if sys.stdout is not None and not sys.stdout.closed:
        sys.stdout.flush()


def drop_output() -> None:
    """What could not be printed is lost: the interpreter would try again at its end, and complain."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError, AttributeError):
            with suppress(OSError, ValueError, AttributeError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def error(err: UserError) -> None:
    """Red title, then the way out."""
    talk.print(f"[bold red]error:[/] {escape(err.message)}", soft_wrap=True)
    _hint(err.hint)


def warn(message: str, hint: str | None = None) -> None:
    talk.print(f"[bold yellow]warning:[/] {escape(message)}", soft_wrap=True)
    _hint(hint)


def _hint(text: str | None) -> None:
    if text:
        talk.print(f"[blue]hint:[/] {escape(text)}", soft_wrap=True)


def note(message: str) -> None:
    talk.print(f"[dim]{escape(message)}[/]", soft_wrap=True)


def emit_json(value: Any) -> None:
    """One JSON document on stdout, for scripts."""
    json.dump(value, sys.stdout, indent=2, ensure_ascii=not _is_utf8(sys.stdout.encoding))
    sys.stdout.write("\n")
