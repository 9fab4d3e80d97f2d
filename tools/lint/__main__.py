"""Run the lints: all, or those named. One line each; what they found below it. Exit code 1 when one found something."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from lint import external
from lint.callers import check_callers
from lint.changes import check_changes
from lint.chips import check_chips
from lint.circles import check_circles, check_firmware
from lint.copies import check_copies
from lint.encodings import check_encodings
from lint.english import check_english
from lint.house import check_house
from lint.includes import check_includes
from lint.owners import check_owners
from lint.problem import Problem
from lint.settings import check_settings

Lint = Callable[[Path], list[Problem]]

LINTS: dict[str, tuple[str, Lint]] = {
    "includes": ("includes follow the data", check_includes),
    "owners": ("parts of the machine have owners", check_owners),
    "callers": ("names in headers are used", check_callers),
    "circles": ("files that call back are few", check_circles),
    "firmware": ("a firmware calls each file", check_firmware),
    "house": ("sizes, file heads, leftovers", check_house),
    "chips": ("virtual chips by their interface", check_chips),
    "changes": ("changes for users, two sentences", check_changes),
    "copies": ("large structures stay where they are", check_copies),
    "encodings": ("text of files is UTF-8", check_encodings),
    "settings": ("settings by name, not by number", check_settings),
    "english": ("plain English for users", check_english),
    "generated": ("generated text is fresh", external.check_generated),
    "ruff": ("Python style", external.check_ruff),
    "ruff-format": ("Python format", external.check_ruff_format),
    "mypy": ("Python types", external.check_mypy),
    "clang-format": ("C format", external.check_clang_format),
    "cppcheck": ("C static analysis", external.check_cppcheck),
    "warnings": ("C warnings, gcc and the newest clang", external.check_compilers),
}

# Programs that run longest: first, so that our own lints, which share one processor, run next to them.
LONGEST_FIRST = ("warnings", "cppcheck", "mypy")

ROOT = Path(__file__).resolve().parents[2]


def main(names: list[str]) -> int:
    unknown = sorted(set(names) - set(LINTS))
    if unknown:
        print(f"no such lint: {', '.join(unknown)}; there are: {', '.join(LINTS)}", file=sys.stderr)
        return 2
    chosen = names or list(LINTS)
    order = sorted(chosen, key=lambda name: LONGEST_FIRST.index(name) if name in LONGEST_FIRST else len(LINTS))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = dict(zip(order, pool.map(_timed, [LINTS[name][1] for name in order]), strict=True))
    for name in chosen:
        problems, seconds = results[name]
        verdict = f"{len(problems)} problem{'s' * (len(problems) != 1)}" if problems else "ok"
        print(f"{name:<13} {LINTS[name][0]:<32} {seconds:5.1f} s  {verdict}")
        for problem in problems:
            print(f"    {problem}")
    return 1 if any(problems for problems, _ in results.values()) else 0


def _timed(lint: Lint) -> tuple[list[Problem], float]:
    begin = time.perf_counter()
    return lint(ROOT), time.perf_counter() - begin


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
