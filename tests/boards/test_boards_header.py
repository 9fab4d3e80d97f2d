"""pin_config.h: compiles for every board, says what the board file says, and is the same every time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from wificnc.board.header import is_movable_to, pin_header_text, signal_groups, write_if_changed
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import AXIS_LETTERS

IDS = [path.stem for path in find_boards()]
FLAGS = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]
PIN_NONE = 0xFF

PROBE = """
#include <stdint.h>
#include <stdio.h>
#include "pin_config.h"

struct output { uint8_t pin; const char *signal; int active; };
struct input { uint8_t pin; const char *signal; int active; int pull; };
#define OUTPUT(pin, signal, active) {pin, #signal, active},
#define INPUT(pin, signal, active, pull) {pin, #signal, active, pull},
static const struct output outputs[] = {BOARD_OUTPUTS(OUTPUT)};
static const struct input inputs[] = {BOARD_INPUTS(INPUT)};
static const uint8_t step_pins[] = BOARD_STEP_PINS;
static const uint8_t limit_pins[] = BOARD_LIMIT_PINS;
static const uint32_t step_masks[] = BOARD_STEP_MASKS;
static const uint32_t dir_masks[] = BOARD_DIR_MASKS;

int main(void)
{
    for (unsigned i = 0; i < sizeof outputs / sizeof *outputs; i++)
        printf("out %s %u %d\\n", outputs[i].signal, outputs[i].pin, outputs[i].active);
    for (unsigned i = 0; i < sizeof inputs / sizeof *inputs; i++)
        printf("in %s %u %d %d\\n", inputs[i].signal, inputs[i].pin, inputs[i].active, inputs[i].pull);
    for (unsigned i = 0; i < 6; i++)
        printf("axis %u %u %u\\n", i, step_pins[i], limit_pins[i]);
    for (unsigned i = 0; i < BOARD_BANK_COUNT; i++)
        printf("bank %u %lu %lu\\n", i, (unsigned long)step_masks[i], (unsigned long)dir_masks[i]);
    printf("timing %u %u %u %u\\n", BOARD_TIMER_HZ, BOARD_STEP_PULSE_NS, BOARD_DIR_SETUP_NS, BOARD_MAX_STEP_RATE_HZ);
    printf("ticks %u %u %u\\n", BOARD_STEP_PULSE_TICKS, BOARD_DIR_SETUP_TICKS, BOARD_MIN_PERIOD_TICKS);
    printf("board %s %d %s\\n", BOARD_ID, BOARD_AXIS_COUNT, BOARD_AXIS_LETTERS);
    return 0;
}
"""


def compiler() -> list[str]:
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    return [sys.executable, "-m", "ziglang", "cc"]


def compile_probe(folder: Path, header: str) -> subprocess.CompletedProcess[str]:
    (folder / "pin_config.h").write_text(header, encoding="utf-8")
    (folder / "probe.c").write_text(PROBE, encoding="utf-8")
    command = [*compiler(), *FLAGS, "probe.c", "-o", "probe"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("board_id", IDS)
def test_header_compiles_and_says_what_the_board_says(board_id: str, tmp_path: Path) -> None:
    board = load_board(board_id)
    result = compile_probe(tmp_path, pin_header_text(board))
    assert result.returncode == 0, result.stderr
    output = subprocess.run([tmp_path / "probe"], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in output.splitlines()]
    numbers = {signal: board.pins.pin[pin].number for signal, pin in board.pin_names().items()}
    pulls = {"none": 0, "up": 1, "down": 2}
    seen = {row[1].removeprefix("SIGNAL_").lower(): row for row in rows if row[0] in ("out", "in")}
    buses = {
        use.signal
        for use in board.uses()
        if use.signal.startswith(("eth_", "serial_", "i2so_", "bus_", "pendant_", "dial_", "driver_"))
    }
    assert set(seen) == set(numbers) - buses
    for use in board.uses():
        if use.signal in buses:
            continue
        row = seen[use.signal]
        assert row[0] == ("out" if use.is_output else "in")
        assert int(row[2]) == numbers[use.signal]
        assert int(row[3]) == (use.active == "high")
        if not use.is_output:
            assert int(row[4]) == pulls[use.pull]
    assert rows[-1] == ["board", board.id, str(len(board.axes)), "".join(board.axes)]
    timing = board.timing
    assert [int(word) for word in rows[-3][1:]] == [
        timing.timer_hz,
        timing.step_pulse_ns,
        timing.dir_setup_ns,
        timing.max_step_rate_hz,
    ]
    assert int(rows[-2][1]) * 10**9 == timing.step_pulse_ns * timing.timer_hz
    assert int(rows[-2][3]) == timing.timer_hz // timing.max_step_rate_hz
    for row in rows:
        if row[0] == "axis":
            letter = AXIS_LETTERS[int(row[1])].lower()
            assert int(row[2]) == numbers.get(f"step_{letter}", PIN_NONE)
            assert int(row[3]) == numbers.get(f"limit_{letter}", PIN_NONE)


@pytest.mark.parametrize("board_id", IDS)
def test_masks_hold_each_pin_exactly_once(board_id: str, tmp_path: Path) -> None:
    board = load_board(board_id)
    assert compile_probe(tmp_path, pin_header_text(board)).returncode == 0
    output = subprocess.run([tmp_path / "probe"], capture_output=True, text=True, check=True).stdout
    banks = [[int(word) for word in line.split()[1:]] for line in output.splitlines() if line.startswith("bank ")]
    width = board.pins.fast.bank_width
    for column, kind in ((1, "step"), (2, "dir")):
        bits = {bank[0] * width + bit for bank in banks for bit in range(width) if bank[column] >> bit & 1}
        pins = {
            board.pins.pin[pin].number for signal, pin in board.pin_names().items() if signal.startswith(f"{kind}_")
        }
        assert bits == pins


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("BOARD_STEP_MASK_0          0x00000006u", "BOARD_STEP_MASK_0          0x00000002u"),
        ("PIN_DIR_X                  3u", "PIN_DIR_X                  1u"),
        ("BOARD_STEP_PULSE_TICKS     36u", "BOARD_STEP_PULSE_TICKS     37u"),
        ("BOARD_DIR_SETUP_TICKS      38u", "BOARD_DIR_SETUP_TICKS      39u"),
        ("BOARD_AXIS_COUNT           6", "BOARD_AXIS_COUNT           7"),
    ],
)
def test_static_asserts_catch_a_wrong_header(old: str, new: str, tmp_path: Path) -> None:
    text = pin_header_text(load_board("esp32s3-devkitc"))
    assert old in text
    result = compile_probe(tmp_path, text.replace(old, new))
    assert result.returncode != 0
    assert "static" in result.stderr.lower()


def test_second_motors_are_in_the_step_masks() -> None:
    """One write to the pins steps both motors of an axis: the masks of the step interrupt hold both."""
    text = pin_header_text(load_board("host-gantry"))
    pins = {"STEP": (0, 1, 2, 6), "DIR": (8, 9, 10, 14)}  # X, Y, Z, second Y
    for kind, numbers in pins.items():
        mask = sum(1 << number for number in numbers)
        assert f"#define BOARD_{kind}_MASK_0         0x{mask:08X}u".split() == next(
            line.split()[:3] for line in text.splitlines() if line.startswith(f"#define BOARD_{kind}_MASK_0 ")
        )
    assert "BOARD_GANGED_AXES          0x02u" in text and "PIN_LIMIT_Y2_MAX           30u" in text
    assert "BOARD_GANGED_AXES          0x00u" in pin_header_text(load_board("esp32s3-zero"))


def test_home_switches_are_an_axis_mask_and_inputs(tmp_path: Path) -> None:
    text = (find_boards()[0].parent / "host.toml").read_text(encoding="utf-8")
    text = text.replace('step = "P1"\n', 'step = "P1"\nhome = { pin = "P46", active = "high" }\n')
    path = tmp_path / "homes.toml"
    path.write_text(text.replace('step = "P5"\n', 'step = "P5"\nhome = "P47"\n'), encoding="utf-8")
    board = load_board(path)
    header = pin_header_text(board)
    assert board.home_axes == 0b100010
    assert "BOARD_HOME_AXES            0x22u" in header
    assert (
        "X(PIN_HOME_Y, SIGNAL_HOME_Y, 1, PIN_PULL_UP)" in header
        and "X(PIN_HOME_C, SIGNAL_HOME_C, 0, PIN_PULL_UP)" in header
    )


def test_header_names_every_signal_a_board_can_wire() -> None:
    known = {signal for group in signal_groups() for signal in group}
    for path in find_boards():
        assert set(load_board(path).pin_names()) <= known
    text = pin_header_text(load_board("esp32s3-zero"))
    assert all(f"#define PIN_{signal.upper()} " in text for signal in known)


def test_header_is_the_same_in_every_process(tmp_path: Path) -> None:
    program = (
        "from wificnc.board.load import load_board; from wificnc.board.header import pin_header_text; "
        "import sys, json; sys.stdout.write(json.dumps(pin_header_text(load_board('esp32-wroom32'))))"
    )
    for seed in ("1", "2"):
        env = {**os.environ, "PYTHONHASHSEED": seed}
        run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=env, capture_output=True, check=True)
        assert json.loads(run.stdout) == pin_header_text(load_board("esp32-wroom32"))


def test_hash_follows_the_source(tmp_path: Path) -> None:
    original = load_board("esp32-wroom32")
    copy = tmp_path / "esp32-wroom32.toml"
    text = original.path.read_text(encoding="utf-8")
    copy.write_text(text, encoding="utf-8")
    assert load_board(copy).sha256 == original.sha256
    copy.write_text(text + "# a word\n", encoding="utf-8")
    assert load_board(copy).sha256 != original.sha256


def test_name_is_quoted_for_c(tmp_path: Path) -> None:
    text = load_board("host").path.read_text(encoding="utf-8")
    path = tmp_path / "quoted.toml"
    path.write_text(text.replace('name = "This computer"', "name = 'a \"b\" \\ c */ ?'"), encoding="utf-8")
    result = compile_probe(tmp_path, pin_header_text(load_board(path)))
    assert result.returncode == 0, result.stderr


def test_write_if_changed_leaves_an_equal_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "new" / "pin_config.h"
    assert write_if_changed(path, "one\n")
    os.utime(path, (1, 1))
    assert not write_if_changed(path, "one\n")
    assert path.stat().st_mtime == 1
    assert write_if_changed(path, "two\n")
    assert path.read_bytes() == b"two\n"


@pytest.mark.parametrize("board_id", IDS)
def test_no_signal_can_be_moved_to_a_pin_that_is_nowhere(board_id: str) -> None:
    """GPIO37 and GPIO38 of the ESP32 are in the chip, and on no module: what no header carries cannot be wired."""
    board = load_board(board_id)
    carried = {pin for header in board.header for pin in header.pins}
    carried |= set(board.onboard) | {use.pin for use in board.uses()}
    movable = {name for name in board.pins.pin for kind in ("output", "input") if is_movable_to(board, name, kind)}
    assert not board.header or movable <= carried
