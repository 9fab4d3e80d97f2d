"""Both step engines of the ESP32, with emulated registers: tests/esp32/pulses.c."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from esp32_registers import ESP32, FLAGS, HERE, INCLUDES, ROOT, chip_folder
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.build.compiler import locate_compiler
from xtensa.headers import rmt_board

SOURCES = (
    *(
        ROOT / "core" / name
        for name in ("base/duty.c", "step/control.c", "step/isr.c", "step/position.c", "step/prep.c")
    ),
    *(ROOT / "targets" / "chip" / name for name in ("gang.c", "step_pins.c")),
    *(ESP32 / "hal" / name for name in ("step_engine.c", "step_interrupt.c", "step_rmt.c")),
)
BUSY_PERCENT = 70  # of core 1 in interrupts at the board's fastest rate: what cuts spans needs the rest


@pytest.mark.parametrize(("chip", "engine"), [("esp32", "gpio"), ("esp32", "rmt"), ("esp32s3", "rmt")])
def test_pulses(chip: str, engine: str, tmp_path: Path) -> None:
    board = rmt_board(chip, tmp_path) if engine == "rmt" else load_board("esp32-wroom32")
    includes = [f"-I{path}" for path in (chip_folder(board, chip, tmp_path), *INCLUDES)]
    budget = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())
    limits = [f"-DEVENT_INSTRUCTIONS={budget['event that ends a span']}", f"-DBUSY_PERCENT={BUSY_PERCENT}"]
    program = tmp_path / "pulses"
    sources = [str(path) for path in (HERE / "pulses.c", HERE / "idle_parts.c", *SOURCES)]
    command = [*locate_compiler(), *FLAGS, *limits, *includes, *sources, "-o", str(program), "-lm"]
    subprocess.run(command, check=True, timeout=HANG_S)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
