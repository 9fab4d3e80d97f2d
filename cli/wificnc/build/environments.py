"""PlatformIO's environments of the boards: build/generated/platformio.ini, which platformio.ini includes.

PlatformIO reads its files before it runs anything of ours, so this one is written by what comes before it: `wificnc
build BOARD`, `make generate`, tools/dev.py.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board
from wificnc.output import write_output

ENVIRONMENTS = Path("build/generated/platformio.ini")
BYTES_A_MB = 1 << 20
_HEAD = "; Generated from boards/*.toml and targets/*/pins*.toml: edit those.\n\n"


def write_environments(root: Path) -> None:
    """Of the boards of boards/, below a tree with targets/. Raises FileProblems for a broken board."""
    text = environments_text([load_board(path) for path in find_boards()], root)
    path = root / ENVIRONMENTS
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_output("PlatformIO's environments", path, text.encode())


def environments_text(boards: Sequence[Board], root: Path) -> str:
    """The whole file. @param root  of targets/"""
    return _HEAD + "\n\n".join(text for board in boards if (text := _environment(board, root))) + "\n"


def _environment(board: Board, root: Path) -> str:
    """Of an ESP32 also the one for finding faults; "" for a board without a build."""
    script = f"targets/{board.target}/platformio.py"  # where PlatformIO has no platform for the chip
    if board.pins.platformio is None:
        lines = [f"[env:{board.id}]", "platform = native", f"extra_scripts = pre:{script}", "test_framework = custom"]
        return "\n".join(lines) if (root / script).is_file() else ""
    lines = [
        f"[env:{board.id}]",
        f"extends = {board.target}",
        "board_build.cmake_extra_args = -DWIFICNC_BOARD=${this.__env__}",
        f"board = {board.pins.platformio.board}",
        *_smaller_flash(board, board.pins.platformio.flash_mb),
        "",
        f"[env:{board.id}-debug]",
        f"extends = env:{board.id}",
        f"board_build.cmake_extra_args = -DWIFICNC_BOARD={board.id} -DWIFICNC_KIND=debug",
    ]
    return "\n".join(lines)


def _smaller_flash(board: Board, usual_mb: int) -> Iterator[str]:
    """The smallest flash that the board is sold with, where that is less than PlatformIO takes for granted."""
    least_mb = min(board.memory.flash_mb, default=usual_mb)
    if least_mb < usual_mb:
        yield f"board_upload.flash_size = {least_mb}MB"
        yield f"board_upload.maximum_size = {least_mb * BYTES_A_MB}"
