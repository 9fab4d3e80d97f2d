"""What the converter has to say about a configuration: what was lost, and what now works differently."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any


class Kind(Enum):
    LOST = "not taken"
    CHANGED = "taken differently"


@dataclass(frozen=True)
class Remark:
    """One thing that the owner of the machine must know."""

    kind: Kind
    key: str  # of the configuration, or of the board file
    line: int  # of the configuration; 0: a key of the board file
    why: str

    @property
    def place(self) -> str:
        return f"{self.key} (line {self.line})" if self.line else self.key

    def __str__(self) -> str:
        return f"{self.place}: {self.why}"

    def as_json(self) -> dict[str, Any]:
        return {"kind": self.kind.value, "key": self.key, "line": self.line, "why": self.why}


@dataclass
class Remarks:
    """All of one configuration."""

    found: list[Remark] = field(default_factory=list)

    def lost(self, key: str, line: int, why: str) -> None:
        self._add(Remark(Kind.LOST, key, line, why))

    def changed(self, key: str, line: int, why: str) -> None:
        self._add(Remark(Kind.CHANGED, key, line, why))

    def of(self, kind: Kind) -> list[Remark]:
        return sorted((remark for remark in self.found if remark.kind is kind), key=lambda remark: remark.line)

    def lines(self, kind: Kind) -> list[str]:
        """As text, the same reason for many keys once."""
        of_why: dict[str, list[Remark]] = {}
        for remark in self.of(kind):
            of_why.setdefault(remark.why, []).append(remark)
        return [f"{_keys(same)}: {why}" for why, same in of_why.items()]

    def _add(self, remark: Remark) -> None:
        if remark not in self.found:
            self.found.append(remark)


def _keys(remarks: list[Remark]) -> str:
    more = f" and {len(remarks) - 1} more" if len(remarks) > 1 else ""
    return remarks[0].place + more
