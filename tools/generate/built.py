"""Generated files that git does not keep, below build/generated: `python -m generate.built` writes the stale ones.

The page's tables, pictures of the pins, the schema of board files, and the environments of PlatformIO. A command that
needs them calls this first, and nothing is computed when no source has changed since.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path

from wificnc import ui
from wificnc.build.lock import build_lock
from wificnc.errors import UserError
from wificnc.output import write_output

ROOT = Path(__file__).resolve().parents[2]
FOLDER = "build/generated"
STAMP = f"{FOLDER}/.stamp"
SOURCES = (
    "boards/*.toml",
    "protocol/*.toml",
    "targets/*/pins*.toml",
    "targets/*/platformio.py",
    "targets/esp32/partitions.csv",
    "examples/machines/*.toml",
    "core/gcode/status.h",
    "core/machine/alarms.def",
    "cli/wificnc/**/*.py",
    "tools/generate/*",
)


def bring_up_to_date(root: Path = ROOT) -> list[str]:
    """Write what differs, and delete what is made no more. @return paths that were written

    Raises FileProblems or ValueError when a table is wrong."""
    stamp = root / STAMP
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == _fingerprint(root):
        return []
    with build_lock(root / FOLDER):
        written = _write(root)
        stamp.write_text(_fingerprint(root), encoding="utf-8")
    return written


def texts(root: Path) -> dict[str, str]:
    """Path in the repository -> text, of all of them."""
    # Here, as most calls find that everything is fresh.
    from wificnc.board.load import find_boards, load_board
    from wificnc.board.picture import draw, svg_text
    from wificnc.build.environments import ENVIRONMENTS, environments_text

    from generate import page
    from generate.board_schema import board_schema_text

    boards = [load_board(path) for path in find_boards()]
    return {
        **{f"{FOLDER}/{name}": text for name, text in page.texts(root, boards).items()},
        **{f"{FOLDER}/pinout/{board.id}.svg": svg_text(draw(board)) for board in boards},
        f"{FOLDER}/board.schema.json": board_schema_text(),
        ENVIRONMENTS.as_posix(): environments_text(boards, root),
    }


def _write(root: Path) -> list[str]:
    made = texts(root)
    for path in _outputs(root):
        if path.relative_to(root).as_posix() not in made:
            path.unlink(missing_ok=True)
    written = []
    for name, text in made.items():
        path = root / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_output(name, path, text.encode())
            written.append(name)
    return written


def _fingerprint(root: Path) -> str:
    """Changes with each source, and with what lies in FOLDER."""
    digest = hashlib.sha256()
    for path in (*_sources(root), *_outputs(root)):
        state = path.stat()
        digest.update(f"{path.relative_to(root)}\0{state.st_size}\0{state.st_mtime_ns}\n".encode())
    return digest.hexdigest()


def _outputs(root: Path) -> list[Path]:
    """Without stamp, lock, and what is being written."""
    found = (root / FOLDER).rglob("*")
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


def _sources(root: Path) -> Iterator[Path]:
    for pattern in SOURCES:
        yield from sorted(path for path in root.glob(pattern) if path.is_file())


def main(root: Path = ROOT) -> int:
    """Exit code 1: a table is wrong."""
    try:
        written = bring_up_to_date(root)
    except UserError as error:
        ui.error(error)
        return error.exit_code
    if written:
        print(f"wrote {len(written)} files in {FOLDER}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
