"""The components of the ESP32's application as ESP-IDF's build reads them first, by CMake."""

from __future__ import annotations

import subprocess
from pathlib import Path

import cmake
import pytest
from patience import HANG_S
from wificnc.build.checkout import checkout_root

ROOT = checkout_root()
ESP32 = ROOT / "targets" / "esp32"
SCRIPT = Path(__file__).with_name("components.cmake")


def read(component: Path) -> set[Path]:
    argv = [Path(cmake.CMAKE_BIN_DIR) / "cmake", f"-DCOMPONENT={component}", "-P", SCRIPT]
    done = subprocess.run(argv, capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stderr
    return {Path(line.removeprefix("-- path ")).resolve() for line in done.stdout.splitlines()}


@pytest.mark.parametrize(
    ("component", "folders"),
    [
        (ESP32 / "components" / "core", ["core"]),
        (ESP32 / "main", ["targets/net", *(f"targets/esp32/{name}" for name in ("app", "hal", "io", "link"))]),
        (ESP32 / "main", [f"targets/esp32/{name}" for name in ("main", "net", "store")]),
    ],
)
def test_a_component_names_all_of_its_sources(component: Path, folders: list[str]) -> None:
    named = read(component)
    assert all(path.exists() for path in named)
    assert named >= {source for folder in folders for source in (ROOT / folder).rglob("*.c")}
