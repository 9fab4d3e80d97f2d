"""The whole machine with a gantry at the ESP32's emulated registers: tests/esp32/gantry.c."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from esp32_registers import ESP32, FLAGS, HERE, ROOT, build_folder, chip_folder, objects
from patience import BUILD_S, HANG_S
from wificnc.board.load import load_board
from wificnc.build.compiler import locate_compiler
from xtensa.headers import by_rmt

PARTS = {
    "app": ("board", "follow", "wired"),
    "hal": ("esp32_hal", "shift_i2s", "shift_spi", "step_engine", "step_interrupt", "step_rmt", "step_shift"),
    "io": ("charge_pump", "inputs", "outputs", "pin_map", "switch_timer"),
}
MODELS = {"esp32": "i2s_model", "esp32s3": "spi_model"}  # of shift registers
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
    ("esp32s3", "spi", "esp32s3-devkitc-shift"),
)


def sources(chip: str) -> list[Path]:
    parts = [ESP32 / folder / f"{name}.c" for folder, names in PARTS.items() for name in names]
    models = [HERE / f"{name}.c" for name in ("gantry", MODELS[chip], "idle_ledc", "idle_parts")]
    return [*models, *sorted((ROOT / "core").rglob("*.c")), *sorted((ROOT / "targets" / "chip").glob("*.c")), *parts]


@pytest.mark.deep  # compiles all of the core; tests/grbl homes in the host's, tests/pic32mz at a real image's pins
@pytest.mark.parametrize("target", BOARDS, ids="-".join)
def test_a_crooked_gantry_homes_square(target: tuple[str, str, str], tmp_path: Path) -> None:
    """By the board file, and on boards without a gantry by $211."""
    chip, engine, board_id = target
    board = load_board(board_id)
    folder = build_folder(f"{board_id}-{engine}")
    chip_folder(by_rmt(board, tmp_path) if engine == "rmt" else board, chip, folder)
    program = tmp_path / "gantry"
    command = [*locate_compiler(), *FLAGS, *map(str, objects(sources(chip), folder)), "-o", str(program), "-lm"]
    subprocess.run(command, check=True, timeout=BUILD_S)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
