"""Runs tests again and again while busy processes run: one that fails there waits for a time, not for an event."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SAID = ROOT / "build" / "trust"  # what the runs with a failure said
BUSY = "while True: pass"
FAILED = re.compile(r"^(?:FAILED|ERROR) ((?:emulators/)?tests/.+?)(?: - .*)?$", re.MULTILINE)
NOTHING_WRONG, SOME_FAILED = 0, 1  # of pytest


def trust(tests: Sequence[str], runs: int, load: int) -> int:
    """Print the tests that failed, and how often. @return exit code"""
    failures: dict[str, int] = defaultdict(int)
    SAID.mkdir(parents=True, exist_ok=True)
    with busy(load):
        for number in range(1, runs + 1):
            failed = run(tests, number)
            for test in failed:
                failures[test] += 1
            print(f"run {number} of {runs}: {len(failed)} failed", flush=True)
    for test, count in sorted(failures.items(), key=lambda item: -item[1]):
        print(f"{count} of {runs} times: {test}")
    print(f"{len(failures)} not to be trusted; what they said: {SAID}" if failures else "all can be trusted")
    return 1 if failures else 0


def run(tests: Sequence[str], number: int) -> list[str]:
    """Those that failed, in one run of pytest."""
    words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-rfE", "-m", "not deep", *tests]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == NOTHING_WRONG:
        return []
    (SAID / f"run-{number}.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    found = FAILED.findall(done.stdout)
    if done.returncode != SOME_FAILED or not found:
        sys.exit(f"pytest ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return found


@contextmanager
def busy(count: int) -> Iterator[None]:
    """So many processes that do nothing but compute."""
    started = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()
