"""Build the site into build/site; a broken link or anchor is an error. Exit code 1 when there is one."""

from __future__ import annotations

import sys
from pathlib import Path

from wificnc import ui
from wificnc.errors import UserError

from pages.build import build

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    site = ROOT / "build" / "site"
    try:
        problems = build(ROOT, site)
    except UserError as error:
        ui.error(error)
        return error.exit_code
    for problem in problems:
        print(problem, file=sys.stderr)
    if problems:
        return 1
    files = [path for path in site.rglob("*") if path.is_file()]
    pages = sum(path.suffix == ".html" for path in files)
    print(f"{pages} pages, {sum(path.stat().st_size for path in files) / 1e6:.1f} MB: {site / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
