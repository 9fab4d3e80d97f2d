"""Both step engines of the ESP32, with emulated registers: tests/esp32/pulses.c."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc.board.header import pin_header_text
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from xtensa.headers import rmt_board

HERE = Path(__file__).parent
ROOT = checkout_root()
ESP32 = ROOT / "targets" / "esp32"
SOURCES = (
    *(
        ROOT / "core" / name
        for name in ("base/duty.c", "step/control.c", "step/isr.c", "step/position.c", "step/prep.c")
    ),
    ROOT / "targets" / "chip" / "step_pins.c",
    *(ESP32 / "hal" / name for name in ("step_engine.c", "step_interrupt.c", "step_i2s.c", "step_rmt.c")),
    HERE / "i2s_model.c",
)
INCLUDES = (HERE / "registers", ESP32, ROOT / "targets" / "chip", ROOT / "core", ESP32 / "test" / "idf_api", HERE)
FLAGS = ("-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")

BUSY_PERCENT = 70  # of core 1 in interrupts at the board's fastest rate: what cuts spans needs the rest


@pytest.mark.parametrize(("chip", "engine"), [("esp32", "gpio"), ("esp32", "rmt"), ("esp32s3", "rmt"), ("esp32", "i2s")])
def test_pulses(chip: str, engine: str, tmp_path: Path) -> None:
    boards = {"gpio": "esp32-wroom32", "i2s": "mks-tinybee"}
    board = rmt_board(chip, tmp_path) if engine == "rmt" else load_board(boards[engine])
    (tmp_path / "pin_config.h").write_text(pin_header_text(board))
    target = f"#define CONFIG_IDF_TARGET_{chip.upper()} 1\n"
    (tmp_path / "sdkconfig.h").write_text(f"{target}#define CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ 240\n")
    includes = [f"-I{path}" for path in (tmp_path, *INCLUDES)]
    budget = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())
    limits = [f"-DEVENT_INSTRUCTIONS={budget['event that ends a span']}", f"-DBUSY_PERCENT={BUSY_PERCENT}"]
    program = tmp_path / "pulses"
    sources = [str(path) for path in (HERE / "pulses.c", *SOURCES)]
    command = [*locate_compiler(), *FLAGS, *limits, *includes, *sources, "-o", str(program), "-lm"]
    subprocess.run(command, check=True, timeout=HANG_S)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
