"""Write what the page is built with: `python -m wificnc.web.generate [--check]`.

web/src/generated/tables.json comes from protocol/*.toml, boards/*.toml, targets/*/pins*.toml, core/gcode/status.h,
cli/wificnc/sim/look.py and targets/esp32/partitions.csv; edit those.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from wificnc.board.load import find_boards, load_board
from wificnc.flash.plan import read_partitions
from wificnc.web.tables import page_tables

ROOT = Path(__file__).resolve().parents[3]
OUTPUT = "web/src/generated/tables.json"
PARTITIONS = "targets/esp32/partitions.csv"


def tables_text(root: Path = ROOT) -> str:
    """The file. Raises FileProblems when a table is broken."""
    boards = [load_board(path) for path in find_boards()]
    nvs = read_partitions((root / PARTITIONS).read_text(encoding="utf-8"))["nvs"]
    return json.dumps(page_tables(boards, nvs), indent=1, ensure_ascii=False) + "\n"


def main(argv: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Exit code 0: the file is fresh (now); 1: --check found it stale."""
    parser = argparse.ArgumentParser(prog="python -m wificnc.web.generate", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail when the file is stale")
    check: bool = parser.parse_args(argv).check
    text = tables_text(root)
    path = root / OUTPUT
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return 0
    if check:
        print(f"{OUTPUT} is stale: run python -m wificnc.web.generate", file=sys.stderr)
        return 1
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")
    print(f"wrote {OUTPUT}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
