"""One thing that a check has found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    ERROR = "error"  # the machine would stop, or leave its travel
    WARNING = "warning"  # it does what it can, which is not what was asked
    NOTE = "note"  # worth knowing


@dataclass(frozen=True)
class Finding:
    """Lines first_line to last_line of the file; 0: of no line."""

    kind: str  # docs/checking.md lists them
    severity: Severity
    first_line: int
    last_line: int
    message: str
    hint: str | None = None
    time_s: float = 0.0  # how long these lines take

    @property
    def lines(self) -> str:
        """17 or 17-204"""
        return str(self.first_line) + (f"-{self.last_line}" if self.last_line != self.first_line else "")
