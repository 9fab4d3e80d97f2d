"""python -m suite times FILE | trust TESTS... | mutants: each says its options by --help."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from suite.mutants import mutate
from suite.times import by_group, read_times
from suite.trust import trust


def main(words: list[str]) -> int:
    """Exit code: 1 when a test is not to be trusted."""
    parser = argparse.ArgumentParser(prog="suite", description="What the tests take, and which fail under load.")
    commands = parser.add_subparsers(dest="command", required=True)
    times = commands.add_parser("times", help="add up what pytest's --times FILE has written")
    times.add_argument("file", type=Path)
    times.add_argument("--by", choices=["ring", "folder", "file", "test"], default="folder")
    trusted = commands.add_parser("trust", help="run tests many times on a busy computer; print those that failed")
    trusted.add_argument("tests", nargs="+", metavar="TEST", help="as pytest names them, from the root of the tree")
    trusted.add_argument("--runs", type=int, default=30)
    trusted.add_argument("--load", type=int, default=8, help="busy processes next to the tests")
    mutants = commands.add_parser("mutants", help="change lines of code; print whether tests of core notice")
    mutants.add_argument("--count", type=int, default=40)
    mutants.add_argument("--seed", type=int, default=0)
    mutants.add_argument("tests", nargs="*", metavar="TEST", help="these alone, as pytest names them")
    asked = parser.parse_args(words)
    if asked.command == "mutants":
        return mutate(asked.count, asked.seed, asked.tests)
    if asked.command == "trust":
        return trust(asked.tests, asked.runs, asked.load)
    print("cases  wall s   cpu s")
    for name, row in by_group(read_times(asked.file), asked.by):
        print(f"{row.cases:5} {row.wall_s:7.1f} {row.cpu_s:7.1f}  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
