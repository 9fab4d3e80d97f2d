"""TOML with line numbers: the values from the standard parser, and the line of every key for messages.

The locator reads only text the parser has already accepted, so it needs no error handling of its own.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wificnc.files.bounded import SMALL_MAX, read_text
from wificnc.files.problem import FileProblems, KeyPath, Problem

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

_CHARACTERS_MAX = 1_000_000  # our largest file has 42,000
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\])*"|\'[^\']*\'', re.DOTALL)
_SCALAR = re.compile(r"[^,\]}#\n]*")
_SPACE = re.compile(r"(?:[ \t]|#[^\n]*)*")
_SPACE_AND_LINES = re.compile(r"(?:\s|#[^\n]*)*")
_DIGITS_MAX = sys.int_info.default_max_str_digits
_LONG_NUMBER = re.compile(rf"(?:\d_?){{{_DIGITS_MAX + 1}}}")
_ERROR_LINE = re.compile(r"^(.*?) \(at line (\d+), column (\d+)\)$", re.DOTALL)


@dataclass(frozen=True)
class TomlFile:
    """A parsed file: its data, its text with \\n line ends, and the line of every key in file order."""

    path: Path
    text: str
    data: dict[str, Any]
    lines: dict[KeyPath, int]

    def line(self, path: KeyPath) -> int:
        """Line of the key, or of the nearest table around it when the key itself is missing."""
        if (*path, 0) in self.lines and path not in self.lines:
            path = (*path, 0)  # [[key]]
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)


class _Locator:
    """A recursive descent over TOML text that notes on which line each key and array element starts."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.array_tables: dict[KeyPath, int] = {}

    def run(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        self._skip(_SPACE_AND_LINES)
        while self.at < len(self.text):
            table = self._header() if self.text[self.at] == "[" else self._key_value(table)
            self._skip(_SPACE_AND_LINES)
        return self.lines

    def _header(self) -> KeyPath:
        is_array = self.text.startswith("[[", self.at)
        start = self.at
        self.at += 2 if is_array else 1
        path = self._in_arrays(self._key())
        if is_array:
            index = self.array_tables.get(path, -1) + 1
            self.array_tables[path] = index
            path = (*path, index)
        self.at += 2 if is_array else 1
        self._note(path, start)
        return path

    def _in_arrays(self, key: KeyPath) -> KeyPath:
        """[a.b] inside the last [[a]] means a[n].b."""
        path: KeyPath = ()
        for part in key[:-1]:
            path = (*path, part)
            if path in self.array_tables:
                path = (*path, self.array_tables[path])
        return (*path, key[-1])

    def _key_value(self, table: KeyPath) -> KeyPath:
        start = self.at
        path = (*table, *self._key())
        self._note(path, start)
        self.at += 1  # =
        self._skip(_SPACE)
        self._value(path)
        return table

    def _key(self) -> KeyPath:
        parts: list[str] = []
        while True:
            self._skip(_SPACE)
            quoted = self.text[self.at] in "\"'"
            part = self._take(_STRING if quoted else _BARE_KEY)
            parts.append(str(tomllib.loads(f"k = {part}")["k"]) if quoted else part)
            self._skip(_SPACE)
            if self.text[self.at] != ".":
                return tuple(parts)
            self.at += 1

    def _value(self, path: KeyPath) -> None:
        first = self.text[self.at]
        if first == "[":
            self._array(path)
        elif first == "{":
            self._inline_table(path)
        else:
            self._take(_STRING if first in "\"'" else _SCALAR)

    def _array(self, path: KeyPath) -> None:
        self.at += 1
        index = 0
        while self._next_item("]"):
            self._note((*path, index), self.at)
            self._value((*path, index))
            index += 1

    def _inline_table(self, path: KeyPath) -> None:
        self.at += 1
        while self._next_item("}"):
            self._key_value(path)

    def _next_item(self, closing: str) -> bool:
        self._skip(_SPACE_AND_LINES)
        if self.text[self.at] == ",":
            self.at += 1
            self._skip(_SPACE_AND_LINES)
        if self.text[self.at] == closing:
            self.at += 1
            return False
        return True

    def _note(self, path: KeyPath, at: int) -> None:
        self.lines.setdefault(path, self.text.count("\n", 0, at) + 1)

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.at)
        assert match, f"the parser accepted what the locator cannot read at offset {self.at}"
        self.at = match.end()
        return match.group()

    def _skip(self, pattern: re.Pattern[str]) -> None:
        self._take(pattern)


def read_toml(path: Path) -> TomlFile:
    """Read and parse a file.

    Raises:
        FileProblems: it cannot be read, is not UTF-8 or is not TOML.
    """
    try:
        text = read_text(path, SMALL_MAX)
    except OSError as err:
        raise FileProblems([Problem(path, 1, "unreadable", "", err.strerror or str(err))]) from err
    except UnicodeDecodeError as err:
        raise FileProblems([Problem(path, 1, "unreadable", "", "is not UTF-8 text")]) from err
    if len(text) > _CHARACTERS_MAX:
        reason = f"is too large: {len(text):,} characters, at most {_CHARACTERS_MAX:,}"
        raise FileProblems([Problem(path, 1, "unreadable", "", reason)])
    try:
        data = tomllib.loads(text)
    except RecursionError as err:
        raise FileProblems([Problem(path, 1, "syntax", "", "is nested too deeply")]) from err
    except tomllib.TOMLDecodeError as err:
        raise FileProblems([_syntax_problem(path, text, str(err))]) from err
    except ValueError as err:  # of int(): more digits than Python converts
        raise FileProblems([_long_number(path, text)]) from err
    try:
        return TomlFile(path, text, data, _Locator(text).run())
    except RecursionError as err:  # less deep than the parser goes
        raise FileProblems([Problem(path, 1, "syntax", "", "is nested too deeply")]) from err


def _long_number(path: Path, text: str) -> Problem:
    found = _LONG_NUMBER.search(text)
    line = text.count("\n", 0, found.start()) + 1 if found else 1
    return Problem(path, line, "syntax", "", f"has a number of more than {_DIGITS_MAX:,} digits")


def _syntax_problem(path: Path, text: str, message: str) -> Problem:
    match = _ERROR_LINE.match(message)
    reason, line = (match[1], int(match[2])) if match else (message, text.count("\n") + 1)
    return Problem(path, line, "syntax", "", f"not TOML: {reason[:1].lower()}{reason[1:]}")
