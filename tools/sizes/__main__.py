"""`python -m sizes measure BOARD --by BUILDER --folder F -o OUT.json`: exit code 1 when a budget is exceeded.
`python -m sizes compare --before F.json --now F.json ... -o OUT.json`: one file; exit code 1 at a growth above 5 %."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.esp32 import slot_bytes
from wificnc.errors import UserError

from sizes.compare import Sizes, growth, measure, read


def main(argv: list[str] | None = None) -> int:
    options = _parser().parse_args(argv)
    try:
        found, lines, wrong = _measure(options) if options.command == "measure" else _compare(options)
    except (UserError, OSError) as err:
        print(f"error: {err}", file=sys.stderr)
        return 2
    options.output.write_text(json.dumps(found, indent=2, sort_keys=True) + "\n", encoding="utf-8")
    for line in lines:
        print(line)
    for line in wrong:
        print(f"error: {line}", file=sys.stderr)
    return 1 if wrong else 0


def _measure(options: argparse.Namespace) -> tuple[Sizes, list[str], list[str]]:
    board = load_board(options.board)
    slot = slot_bytes((checkout_root() / "targets/esp32/partitions.csv").read_text(encoding="utf-8"))
    found, over = measure(f"{board.id} by {options.by}", options.folder, board.chip, slot)
    return found, [f"{name}: {row}" for name, row in found.items()], over


def _compare(options: argparse.Namespace) -> tuple[Sizes, list[str], list[str]]:
    """Without an earlier build there is nothing to compare with."""
    now = read(options.now)
    before = read([options.before]) if options.before.is_file() else {}
    return now, *growth(before, now)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="sizes", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("measure")
    one.add_argument("board")
    one.add_argument("--by", required=True, help="platformio or idf")
    one.add_argument("--folder", type=Path, required=True, help="with firmware.bin and firmware.elf")
    both = commands.add_parser("compare")
    both.add_argument("--before", type=Path, required=True, help="need not be there")
    both.add_argument("--now", type=Path, required=True, nargs="+")
    for command in (one, both):
        command.add_argument("-o", "--output", type=Path, required=True)
    return parser


if __name__ == "__main__":
    sys.exit(main())
