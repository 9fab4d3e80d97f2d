"""The step engines of the ESP32, with emulated registers: tests/esp32/pulses.c."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from esp32_registers import ESP32, FLAGS, HERE, INCLUDES, ROOT, header_folder
from patience import HANG_S
from slow import slow_but
from wificnc.board.header import pin_header_text
from wificnc.board.load import load_board
from wificnc.build.compiler import locate_compiler
from xtensa.headers import rmt_board

SOURCES = (
    *(
        ROOT / "core" / name
        for name in ("base/duty.c", "step/control.c", "step/isr.c", "step/position.c", "step/prep.c")
    ),
    *(ROOT / "targets" / "chip" / name for name in ("gang.c", "step_pins.c")),
    *(
        ESP32 / "hal" / name
        for name in ("step_engine.c", "step_interrupt.c", "step_shift.c", "shift_i2s.c", "shift_spi.c", "step_rmt.c")
    ),
    *(HERE / name for name in ("idle_parts.c", "pulses_chip.c")),
)
BOARDS = {"gpio": "esp32-wroom32", "i2s": "mks-tinybee", "spi": "esp32s3-devkitc-shift"}
BUSY_PERCENT = 70  # of core 1 in interrupts at the board's fastest rate: what cuts spans needs the rest
GRID_CYCLES = 480  # 2 us at 240 MHz


def built(folder: Path, chip: str, header: str) -> Path:
    """The program of a board, whose pin_config.h this is."""
    includes = [f"-I{path}" for path in (header_folder(header, chip, folder), *INCLUDES)]
    budget = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())
    budget = budget["by SPI"] if "BOARD_STEP_ENGINE_SPI /*" in header else budget
    limits = [f"-DEVENT_INSTRUCTIONS={budget['event that ends a span']}", f"-DBUSY_PERCENT={BUSY_PERCENT}"]
    program = folder / "pulses"
    model = HERE / ("spi_model.c" if chip == "esp32s3" else "i2s_model.c")
    sources = [str(path) for path in (HERE / "pulses.c", model, *SOURCES)]
    command = [*locate_compiler(), *FLAGS, *limits, *includes, *sources, "-o", str(program), "-lm"]
    subprocess.run(command, check=True, timeout=HANG_S)
    return program


def said(program: Path, *words: str) -> str:
    done = subprocess.run([program, *words], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout


ENGINES = (("esp32", "gpio"), ("esp32", "rmt"), ("esp32s3", "rmt"), ("esp32", "i2s"), ("esp32s3", "spi"))


@pytest.mark.parametrize("target", slow_but(("esp32", "gpio").__eq__, ENGINES), ids="-".join)
def test_pulses(target: tuple[str, str], tmp_path: Path) -> None:
    chip, engine = target
    board = rmt_board(chip, tmp_path) if engine == "rmt" else load_board(BOARDS[engine])
    said(built(tmp_path, chip, pin_header_text(board)))


@pytest.mark.slow
@pytest.mark.parametrize(("chip", "engine"), [("esp32", "i2s"), ("esp32s3", "spi")])
def test_shift_registers_make_the_steps_of_the_interrupts_plan_within_a_word(
    chip: str, engine: str, tmp_path: Path
) -> None:
    """Step for step as pins that the interrupt writes, and the same time later, but for the words' grid."""
    header = pin_header_text(load_board(BOARDS[engine]))
    by_pins = header.replace(f"BOARD_STEP_ENGINE          BOARD_STEP_ENGINE_{engine.upper()}", "BOARD_STEP_ENGINE 0")
    assert by_pins != header
    traces = []
    for name, text in (("pins", by_pins), ("registers", header)):
        lines = said(built(tmp_path / name, chip, text), "trace").splitlines()
        traces.append([tuple(map(int, line.split())) for line in lines if line.count(" ") == 2])
    pins, registers = (sorted(trace, key=lambda step: (step[0], step[2])) for trace in traces)
    assert len(pins) > 5_000
    assert [step[:2] for step in registers] == [step[:2] for step in pins]
    later = [register[2] - pin[2] for register, pin in zip(registers, pins, strict=True)]
    assert min(later) > 0
    assert max(later) - min(later) <= GRID_CYCLES, (min(later), max(later))
