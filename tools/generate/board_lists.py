"""The board lists inside hand-written files: platformio.ini, README.md, the menu of mkdocs.yml."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from wificnc.board.model import Board

from generate.files import with_region
from generate.markdown import table_text

REGION = "boards"
BYTES_A_MB = 1 << 20


def list_texts(boards: Sequence[Board], root: Path) -> dict[str, str]:
    """Path in the repository -> text. Raises ValueError for a file without its region."""
    regions = {
        "platformio.ini": "\n\n".join(text for board in boards if (text := _environment(board, root))) + "\n",
        "mkdocs.yml": "".join(_menu(boards)),
        "README.md": _readme(boards) + "\n\n",
    }
    return {
        path: with_region((root / path).read_text(encoding="utf-8"), REGION, text) for path, text in regions.items()
    }


def _environment(board: Board, root: Path) -> str:
    """PlatformIO's environment of a board; of an ESP32 also the one for finding faults; none without a build."""
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


def _menu(boards: Sequence[Board]) -> Iterator[str]:
    for board in boards:
        if board.pins.firmware and board.pins.firmware.page:  # generate/board_start.py writes it
            yield f"      - {json.dumps(board.name)}: docs/start/{board.id}.md\n"


def _readme(boards: Sequence[Board]) -> str:
    rows = [
        [
            f"`{board.id}`",
            board.axes_text,
            f"{board.timing.max_step_rate_hz // 1000} k",
            _network(board),
            _state(board),
        ]
        for board in boards
    ]
    return table_text(["board", "axes", "steps/s", "network", "state"], rows)


def _network(board: Board) -> str:
    firmware = board.pins.firmware
    ways = [firmware.network if firmware else None, "Ethernet" if board.ethernet else None]
    return ", ".join(way for way in ways if way)


def _state(board: Board) -> str:
    firmware = board.pins.firmware
    if firmware is None:
        return "no firmware yet"
    return f"[firmware](docs/{firmware.page}), {firmware.state}" if firmware.page else firmware.state
