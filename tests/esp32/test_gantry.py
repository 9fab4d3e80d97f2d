"""The whole machine with a gantry at the ESP32's emulated registers: tests/esp32/gantry.c."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from esp32_registers import ESP32, FLAGS, HERE, INCLUDES, ROOT, chip_folder
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.build.compiler import locate_compiler
from xtensa.headers import by_rmt

PARTS = {
    "app": ("board", "follow", "wired"),
    "hal": ("esp32_hal", "step_engine", "step_i2s", "step_interrupt", "step_rmt"),
    "io": ("inputs", "outputs", "pin_map", "switch_timer"),
}
BOARDS = (
    ("esp32", "gpio", "esp32-wroom32-gantry"),
    ("esp32", "gpio", "esp32-wroom32"),
    ("esp32", "rmt", "esp32-wroom32-gantry"),
    ("esp32", "rmt", "esp32-wroom32"),
    ("esp32", "i2s", "mks-tinybee-gantry"),
    ("esp32", "i2s", "mks-tinybee"),
    ("esp32s3", "gpio", "esp32s3-devkitc-gantry"),
    ("esp32s3", "gpio", "esp32s3-devkitc"),
    ("esp32s3", "rmt", "esp32s3-devkitc-gantry"),
)


def sources() -> list[Path]:
    parts = [ESP32 / folder / f"{name}.c" for folder, names in PARTS.items() for name in names]
    return [*sorted((ROOT / "core").rglob("*.c")), *sorted((ROOT / "targets" / "chip").glob("*.c")), *parts]


@pytest.mark.parametrize(("chip", "engine", "board_id"), BOARDS)
def test_a_crooked_gantry_homes_square(chip: str, engine: str, board_id: str, tmp_path: Path) -> None:
    """By the board file, and on boards without a gantry by $211."""
    board = load_board(board_id)
    folder = chip_folder(by_rmt(board, tmp_path) if engine == "rmt" else board, chip, tmp_path)
    program = tmp_path / "gantry"
    includes = [f"-I{path}" for path in (folder, *INCLUDES)]
    files = [
        str(path)
        for path in (*(HERE / name for name in ("gantry.c", "i2s_model.c", "idle_ledc.c", "idle_parts.c")), *sources())
    ]
    subprocess.run(
        [*locate_compiler(), *FLAGS, *includes, *files, "-o", str(program), "-lm"], check=True, timeout=HANG_S
    )
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
