"""One figure of a build against what there is, and against what we allow."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Size:
    """One figure of a firmware, in bytes."""

    name: str
    used: int
    there: int
    budget: int

    @property
    def is_over(self) -> bool:
        return self.used > self.budget

    def __str__(self) -> str:
        return f"{self.used:,} of {self.there:,} bytes ({self.used / self.there:.0%}; budget {self.budget:,})"
