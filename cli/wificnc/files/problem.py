"""A problem in a file that a person wrote: where, which rule, why, and what would be legal instead."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wificnc.errors import UserError
from wificnc.files.paths import shown

KeyPath = tuple[str | int, ...]


def key_text(path: KeyPath) -> str:
    """("output", "misc", 1) -> output.misc[1]"""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


@dataclass(frozen=True)
class Finding:
    """What a rule found, before the file and the line are known."""

    rule: str
    path: KeyPath
    reason: str
    hint: str | None = None


@dataclass(frozen=True)
class Problem:
    """One problem, ready to be shown."""

    file: Path
    line: int
    rule: str
    key: str
    reason: str
    hint: str | None = None

    def __str__(self) -> str:
        key = f"{self.key}: " if self.key else ""
        text = f"{shown(self.file)}:{self.line}: {key}{self.reason} [{self.rule}]"
        return f"{text}\n  hint: {self.hint}" if self.hint else text

    def as_json(self) -> dict[str, Any]:
        return {
            "file": shown(self.file),
            "line": self.line,
            "rule": self.rule,
            "key": self.key,
            "reason": self.reason,
            "hint": self.hint,
        }


class FileProblems(UserError):
    """A file that breaks rules: all of them, in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: Sequence[Problem] = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))
