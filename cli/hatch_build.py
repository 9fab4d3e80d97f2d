"""A hook of the package's build: a wheel carries the boards, tables, sources, firmware and page that commands need."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Read at wificnc/carried (cli/wificnc/files/paths.py). firmware/ is there when `wificnc release` builds the package.
CARRIED = (
    "CMakeLists.txt",
    "LICENSE",
    "boards",
    "core",
    "examples/inlay.nc",  # of `wificnc demo`
    "examples/machines",
    "firmware",
    "linuxcnc",
    "platformio.ini",
    "protocol",
    "targets",
)
# Read at wificnc/page (cli/wificnc/files/paths.py): `wificnc release` puts it at page/, `make web` at web/dist.
PAGES = ("page", "web/dist")


class Carry(BuildHookInterface):
    """An editable installation reads them in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        root = Path(self.root)
        carried = {str(root / name): f"wificnc/carried/{name}" for name in CARRIED if (root / name).exists()}
        page = next((name for name in PAGES if (root / name / "index.html").is_file()), None)
        build_data["force_include"].update(carried | ({str(root / page): "wificnc/page"} if page else {}))
