"""A hook of the package's build: a wheel carries the boards, tables, C sources and firmware that its commands need."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Read at wificnc/carried (cli/wificnc/checked/paths.py). firmware/ is there when `wificnc release` builds the package.
CARRIED = (
    "CMakeLists.txt",
    "LICENSE",
    "boards",
    "core",
    "examples/machines",
    "firmware",
    "platformio.ini",
    "protocol",
    "targets",
    "tools/mzsim",
)


class Carry(BuildHookInterface):
    """An editable installation reads them in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "editable":
            there = (name for name in CARRIED if (Path(self.root) / name).exists())
            build_data["force_include"].update({f"{self.root}/{name}": f"wificnc/carried/{name}" for name in there})
