"""Adds up what each test took (pytest's --times FILE, tests/support/times.py)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Taken:
    """By some tests, of all workers together."""

    cases: int = 0
    wall_s: float = 0.0
    cpu_s: float = 0.0


@dataclass(frozen=True)
class Timed:
    """One case."""

    wall_s: float
    cpu_s: float
    ring: str
    test: str

    def group(self, by: str) -> str:
        """The case's ring, folder, file or test, each with its ring before it."""
        file, _, rest = self.test.partition("::")
        test = f"{file}::{rest.partition('[')[0]}"
        groups = {"ring": "", "folder": file.rpartition("/")[0], "file": file, "test": test}
        return f"{self.ring:8} {groups[by]}".rstrip()


def read_times(file: Path) -> list[Timed]:
    rows = (line.split("\t") for line in file.read_text(encoding="utf-8").splitlines())
    return [Timed(float(wall), float(cpu), ring, test) for wall, cpu, ring, test in rows]


def by_group(rows: Iterable[Timed], by: str) -> list[tuple[str, Taken]]:
    """Sums, those that take most of the processor first."""
    sums: dict[str, Taken] = defaultdict(Taken)
    for row in rows:
        taken = sums[row.group(by)]
        taken.cases += 1
        taken.wall_s += row.wall_s
        taken.cpu_s += row.cpu_s
    return sorted(sums.items(), key=lambda item: -item[1].cpu_s)
