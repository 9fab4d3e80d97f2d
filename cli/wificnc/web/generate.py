"""Write what the page is built with: `python -m wificnc.web.generate [--check]`.

web/src/generated/tables.json comes from protocol/*.toml, boards/*.toml, targets/*/pins*.toml, core/gcode/status.h,
cli/wificnc/sim/look.py and targets/esp32/partitions.csv; edit those.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from wificnc import generated
from wificnc.board.load import find_boards, load_board
from wificnc.flash.plan import read_partitions
from wificnc.generated import ROOT
from wificnc.web.tables import page_tables

OUTPUT = "web/src/generated/tables.json"
PARTITIONS = "targets/esp32/partitions.csv"


def tables_text(root: Path = ROOT) -> str:
    """The file. Raises FileProblems when a table is broken."""
    boards = [load_board(path) for path in find_boards()]
    nvs = read_partitions((root / PARTITIONS).read_text(encoding="utf-8"))["nvs"]
    return json.dumps(page_tables(boards, nvs), indent=1, ensure_ascii=False) + "\n"


def main(argv: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Exit code: that of generated.run()."""
    return generated.run("wificnc.web.generate", __doc__, lambda: {OUTPUT: tables_text(root)}, argv, root)


if __name__ == "__main__":
    sys.exit(main())
