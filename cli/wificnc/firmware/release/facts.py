"""What there is to make a release of: the commit, and which firmware has been built. Looks only."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from wificnc import __version__
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board
from wificnc.build.esp32 import git_revision
from wificnc.build.mips import find_compiler
from wificnc.errors import BuildError, ReleaseError
from wificnc.files.jsonfile import read_json
from wificnc.firmware.release.plan import Source

NEEDS_WORKFLOW = (
    "its compiler comes from Espressif's download servers: the release workflow builds it, or `wificnc build {board}`"
)


def read_source(root: Path, environment: Mapping[str, str] = os.environ) -> Source:
    """Version, commit and its time, or SOURCE_DATE_EPOCH's. Raises ReleaseError."""
    run = subprocess.run(
        ["git", "-C", str(root), "log", "-1", "--format=%ct"],
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
        errors="replace",
    )
    if run.returncode != 0:
        raise ReleaseError(f"{root} is not a git repository: a release is made from a commit", hint="git clone it")
    given = environment.get("SOURCE_DATE_EPOCH", "").strip() or run.stdout.strip()
    if not given.isdigit():
        raise ReleaseError(f"SOURCE_DATE_EPOCH is {given!r}, not seconds since 1970")
    return Source(__version__, git_revision(root), int(given))


def firmware_boards() -> list[Board]:
    """Every board with a chip to write."""
    return [board for path in find_boards() if (board := load_board(path)).target != "host"]


def look(root: Path, source: Source, boards: Sequence[Board]) -> dict[str, str]:
    """Board -> why there can be no firmware of it."""
    found = {board.id: _why_missing(root, source, board) for board in boards}
    return {board: why for board, why in found.items() if why is not None}


def _why_missing(root: Path, source: Source, board: Board) -> str | None:
    if board.target == "esp32":
        return _esp32_missing(root / "build" / board.id / "build.json", source, board)
    try:
        find_compiler("gcc")
    except BuildError as err:
        return f"{err.message}; {err.hint}"
    return None


def _esp32_missing(record: Path, source: Source, board: Board) -> str | None:
    """A build of another commit is none. What is damaged is reported when it is read."""
    if not record.is_file():
        return NEEDS_WORKFLOW.format(board=board.id)
    try:
        facts = read_json(record)
        revision, kind = facts.get("revision", "unknown"), facts.get("kind", "release")
    except (ValueError, AttributeError):
        return None
    if kind != "release":
        return f"it is a {kind} build: `wificnc build {board.id}`"
    if revision != source.revision:
        return f"it was built from {revision}, and this is {source.revision}: `wificnc build {board.id}`"
    return None
