"""What the flasher page reads: ESP Web Tools' manifests, and an index of all boards. Pure."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any

from wificnc.board.model import Board
from wificnc.firmware.flash.plan import CHIP_FAMILIES, Region
from wificnc.firmware.release.esp32 import Esp32Firmware

INDEX_SCHEMA = 1
IMPROV_WAIT_S = 10  # a first start makes the storage


def file_name(region: Region) -> str:
    return f"{region.name.replace(' ', '-')}.bin"


def manifest(board: Board, version: str, firmware: Esp32Firmware) -> dict[str, Any]:
    """Of ESP Web Tools. Its parts leave the settings alone, unless the user lets the page erase everything."""
    parts = [{"path": file_name(region), "offset": region.offset} for region in firmware.regions]
    return {
        "name": f"WiFiCNC for {board.name}",
        "version": version,
        "new_install_prompt_erase": True,
        "new_install_improv_wait_time": IMPROV_WAIT_S if firmware.has_improv else 0,
        "builds": [{"chipFamily": CHIP_FAMILIES[board.chip], "parts": parts}],
    }


def esp32_files(board: Board, version: str, firmware: Esp32Firmware) -> dict[str, bytes]:
    """Path below firmware/ -> content."""
    files = {f"{board.id}/{file_name(region)}": region.data for region in firmware.regions}
    return {**files, f"{board.id}/manifest.json": json_bytes(manifest(board, version, firmware))}


def index_row(board: Board, files: dict[str, bytes], missing: str | None, flash_mb: int | None) -> dict[str, Any]:
    """A board of index.json. @param files  of this board, path below firmware/ -> content
    @param missing  why there is no firmware. @param flash_mb  that an ESP32's firmware needs"""
    path = f"{board.id}/manifest.json"
    build = {"path": path, "flash_mb": flash_mb, "memory_mode": board.memory.mode, "psram_mb": board.memory.psram_mb}
    return {
        "id": board.id,
        "name": board.name,
        "summary": board.summary,
        "target": board.target,
        "chip": board.chip,
        "chip_family": CHIP_FAMILIES.get(board.chip),
        "memory": board.memory.model_dump(mode="json"),
        "missing": missing,
        "manifests": [build] if path in files else [],
        "files": [
            {"path": name, "size": len(data), "sha256": hashlib.sha256(data).hexdigest()}
            for name, data in sorted(files.items())
        ],
    }


def index(version: str, revision: str, rows: Sequence[dict[str, Any]]) -> bytes:
    return json_bytes({"schema": INDEX_SCHEMA, "version": version, "revision": revision, "boards": list(rows)})


def json_bytes(value: Any) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False) + "\n").encode()
