"""Shift registers behind I2S or SPI: their outputs are pins, with rules of their own."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board import paths
from wificnc.board.header import pin_header_text
from wificnc.board.load import check_board, load_board
from wificnc.board.rules import pulse_rate_hz
from wificnc.board.shift_registers import pulse_engine, step_grid_ns

GOOD_TEXT = (paths.BOARDS / "mks-dlc32-v21.toml").read_text(encoding="utf-8")
REGISTERS = '[i2so]\nbck = "GPIO16"\nws = "GPIO17"\ndata = "GPIO21"\noutputs = 8\n'


def problems(tmp_path: Path, text: str, old: str, new: str) -> list[tuple[str, str, str]]:
    assert text.count(old) == 1, old
    path = tmp_path / "edited.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return [(problem.rule, problem.key, problem.reason) for problem in check_board(path)]


@pytest.mark.parametrize(
    ("old", "new", "rule", "key", "said"),
    [
        ('probe = "GPIO22"', 'probe = "I2SO.7"', "output-only", "input.probe", "cannot be read"),
        ('step = "I2SO.5"', 'step = "I2SO.8"', "no-such-pin", "axis.y.step", "no pin 'I2SO.8'"),
        ('step = "I2SO.5"', 'step = "GPIO23"', "shift-register", "axis.y.step", "show steps and directions together"),
        (
            'spindle_pwm = "GPIO32"',
            'spindle_pwm = "I2SO.7"',
            "shift-register",
            "output.spindle_pwm",
            "a pin of the chip",
        ),
        (
            'coolant_flood = "GPIO25"',
            'coolant_flood = "I2SO.7"',
            "boot-level",
            "output.coolant_flood",
            "undefined level",
        ),
        ('data = "GPIO21"', 'data = "I2SO.7"', "shift-register", "i2so.data", "a pin of the chip"),
        ('bck = "GPIO16"', 'bck = "GPIO36"', "input-only", "i2so.bck", "can only be read"),
        ("step_pulse_ns = 2_000", "step_pulse_ns = 1_800", "shift-register", "timing.step_pulse_ns", "2000 ns"),
        ("dir_setup_ns = 2_000", "dir_setup_ns = 34_000", "shift-register", "timing.dir_setup_ns", "too long"),
        (
            "max_step_rate_hz = 240_000",
            "max_step_rate_hz = 260_000",
            "pulse-timing",
            "timing.max_step_rate_hz",
            "4000 ns",
        ),
        (REGISTERS, "", "shift-register", "step.engine", "[i2so]"),
        ('[step]\nengine = "i2s"\n', "", "shift-register", "i2so", 'engine = "i2s"'),
    ],
)
def test_what_registers_cannot_do_is_refused(
    tmp_path: Path, old: str, new: str, rule: str, key: str, said: str
) -> None:
    text = GOOD_TEXT.replace('misc = ["I2SO.7"]\n', "")
    found = [
        problem
        for problem in problems(tmp_path, text, old, new)
        if (problem[0], problem[1]) == (rule, key) and said in problem[2]
    ]
    assert found


S3_TEXT = (paths.BOARDS / "esp32s3-devkitc-shift.toml").read_text(encoding="utf-8")


def test_the_s3_has_them_by_its_spi() -> None:
    """Its I2S peripheral takes no words of the processor, so pulses are no multiple of a frame."""
    board = load_board("esp32s3-devkitc-shift")
    assert (pulse_engine(board), step_grid_ns(board)) == ("spi", 0)
    header = pin_header_text(board)
    for line in ("BOARD_STEP_ENGINE          BOARD_STEP_ENGINE_SPI", "BOARD_STEP_GRID_NS         0u"):
        assert f"#define {line}" in header


@pytest.mark.parametrize(
    ("old", "new", "key", "said"),
    [
        ("step_pulse_ns = 2_500", "step_pulse_ns = 1_800", "timing.step_pulse_ns", "shorter than a word"),
        ('spi_host = "SPI3"', 'spi_host = "SPI2"', "ethernet.spi_host", "sends to the shift registers"),
        ('step = "I2SO.4"', 'step = "GPIO1"', "axis.y.step", "show steps and directions together"),
    ],
)
def test_what_the_spi_cannot_do_is_refused(tmp_path: Path, old: str, new: str, key: str, said: str) -> None:
    found = problems(tmp_path, S3_TEXT, old, new)
    assert [problem for problem in found if problem[:2] == ("shift-register", key) and said in problem[2]]


@pytest.mark.parametrize(("pulse_us", "rate_hz"), [(3, 160_000), (4, 110_611), (5, 90_409)])
def test_the_rate_of_the_spi_goes_by_any_pulse(pulse_us: int, rate_hz: int) -> None:
    """Less the 500 events a second that diagonals may need."""
    assert pulse_rate_hz(load_board("esp32s3-devkitc-shift"), pulse_us) == rate_hz


def test_outputs_are_numbered_after_the_chips_pins() -> None:
    text = pin_header_text(load_board("mks-tinybee"))
    for line in ("PIN_STEP_X                 65u", "PIN_MISC_OUT_0             83u", "BOARD_I2SO_FIRST           64u"):
        assert f"#define {line}" in text
    free = next(line for line in text.splitlines() if "BOARD_FREE_OUTPUT_PINS" in line)
    assert "64u" not in free and "25u" not in free  # soldered, as the registers' own pins


@pytest.mark.parametrize(("pulse_us", "rate_hz"), [(2, 240_000), (3, 124_500), (4, 124_500), (5, 82_833)])
def test_the_rate_goes_by_whole_words(pulse_us: int, rate_hz: int) -> None:
    assert pulse_rate_hz(load_board("mks-dlc32-v21"), pulse_us) == rate_hz
