"""Which firmware is meant when only a board is named."""

from __future__ import annotations

from pathlib import Path

from wificnc.build.checkout import built_folder
from wificnc.files import paths

RECORDS = ("build.json", "wificnc.hex")  # a folder with one of these holds firmware


def firmware_folder(board_id: str) -> Path:
    """What was built here, else what the installed package carries. The folder need not be there."""
    built = built_folder(board_id)
    carried = paths.ROOT / "firmware" / board_id
    if built is not None and (is_firmware(built) or not is_firmware(carried)):
        return built
    return carried


def is_firmware(folder: Path) -> bool:
    return any((folder / name).is_file() for name in RECORDS)
