"""The parts of the ESP32's firmware that need no chip, as C programs on this computer."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from board_keys import published_keys
from esp32_registers import FLAGS, build_folder, chip_folder, objects
from patience import HANG_S
from slow import slow_but
from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from wificnc.build.host import build_program

HERE = Path(__file__).parent
FACTS = (0x0312, 0x0525, 0x0704)  # e-stop's sense, the encoder's filter, the SPI controller of Ethernet
ESP32 = checkout_root() / "targets" / "esp32"
BOARDS = [path.stem for path in find_boards() if load_board(path).target == "esp32"]
QUICK = ("esp32-wroom32", "esp32s3-devkitc-gantry", "esp32s3-devkitc-shift", "mks-tinybee")  # both chips, each engine

# program -> the firmware's files in it
PROGRAMS = {
    "two_sides": (),  # the machine with a motion side of its own: two real threads
    "io_parts": ("../chip/gang.c", "../chip/step_pins.c", "io/encoder_counts.c", "io/dial_counts.c"),
    "access_store": ("net/access_store.c",),
    "crowd": (),
    "little_memory": (),
    "gate": (),
    "trust": (),
    "turns": (),
    "qr": (),
    "pendant": (),
    "pendant_turns": (),
    "reports": (),
    "rx_all": (),
    "websocket": (),
    "improv": ("link/improv.c",),
    "ota": ("net/ota.c",),
    "charge_pump": ("io/charge_pump.c",),
    "driver_bus": ("io/driver_bus.c",),
    "device_keys": ("app/device_keys.c", "io/pin_map.c", "store/nvs_device.c"),
    "pin_map": ("io/pin_map.c",),
    "entropy": ("app/entropy.c",),
    "policies": (
        "app/boot_guard.c",
        "app/restart_note.c",
        "net/link_policy.c",
        "net/update_trial.c",
        "net/wifi_policy.c",
    ),
    "nvs_store": ("store/nvs_channels.c", "store/nvs_keys.c", "store/nvs_store.c"),
    "serial": ("link/serial_stream.c",),
    "spindle_bus": ("io/spindle_bus.c",),
    "spindle_pwm": ("hal/spindle_pwm.c",),
    "lines": ("io/lines.c", "io/pin_map.c", "store/nvs_channels.c"),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_program(name: str) -> None:
    sources = [HERE / f"{name}.c", *(ESP32 / source for source in PROGRAMS[name])]
    output = checkout_root() / "build" / "tests" / name
    write_if_changed(output.parent / "board" / "pin_config.h", pin_header_text(load_board("esp32s3-devkitc")))
    defaults = (ESP32 / "sdkconfig.defaults").read_text()
    ticks = re.findall(r"^(CONFIG_FREERTOS_HZ)=(\d+)$", defaults, re.MULTILINE)
    write_if_changed(output.parent / "board" / "sdkconfig.h", "".join(f"#define {n} {hz}\n" for n, hz in ticks))
    folders = [f"-I{ESP32}", f"-I{output.parent / 'board'}", f"-idirafter{ESP32 / 'test' / 'idf_api'}"]
    program = build_program(sources, output, "release", ["-pthread", *folders])
    options = re.findall(r"^(CONFIG_UART_\w+)=y$", defaults, re.MULTILINE)
    done = subprocess.run([program, *options], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 failures" in done.stdout


def test_outputs_of_shift_registers() -> None:
    output = checkout_root() / "build" / "tests" / "shifted_outputs"
    folder = output.parent / "board-shifted"
    write_if_changed(folder / "pin_config.h", pin_header_text(load_board("mks-tinybee")))
    sources = [HERE / "shifted_outputs.c", HERE / "idle_ledc.c"]
    sources += [ESP32 / "io/charge_pump.c", ESP32 / "io/outputs.c", ESP32 / "io/pin_map.c"]
    write_if_changed(folder / "sdkconfig.h", "#define CONFIG_IDF_TARGET_ESP32 1\n#define CONFIG_FREERTOS_HZ 1000\n")
    folders = [f"-I{ESP32}", f"-I{folder}", f"-idirafter{ESP32 / 'test' / 'idf_api'}"]
    program = build_program(sources, output, "release", folders)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.alike(4)
@pytest.mark.parametrize("board_id", slow_but(QUICK.__contains__, BOARDS, BOARDS[::3].__contains__))
def test_outputs_are_those_of_the_board_file(board_id: str) -> None:
    """What a board lacks is refused by the core; the firmware learns it from the pin map, moved pins included."""
    board = load_board(board_id)
    output = checkout_root() / "build" / "tests" / f"wired-{board_id}"
    folder = output.parent / f"board-{board_id}"
    write_if_changed(folder / "pin_config.h", pin_header_text(board))
    parts = ("app/device_keys.c", "app/wired.c", "io/pin_map.c", "store/nvs_device.c")
    sources = [HERE / "wired.c", *(ESP32 / part for part in parts)]
    folders = [f"-I{ESP32}", f"-I{folder}", f"-idirafter{ESP32 / 'test' / 'idf_api'}"]
    program = build_program(sources, output, "release", folders)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=True)
    wired = 63 & ~board.missing_outputs
    without_enable = wired if board.output.spindle_pwm else wired & ~3
    outputs, pins, facts = ([int(word) for word in line.split()] for line in done.stdout.splitlines())
    misc = len(board.output.misc)
    assert outputs == [wired, misc, without_enable, misc if misc > 2 else 0]
    keys = published_keys(board.path)
    assert pins == [value for key, value in sorted(keys.items()) if key not in FACTS]
    assert facts == [keys[key] for key in FACTS]


def run_parts(name: str, parts: tuple[str, ...], chip: str, folder: Path) -> None:
    """A program of the firmware's files in which all else is made up."""
    board = load_board({"esp32": "esp32-wroom32", "esp32s3": "esp32s3-devkitc"}[chip])
    headers = chip_folder(board, chip, build_folder(f"{name}-{chip}"))
    sources = [HERE / f"{name}.c", *(ESP32 / part for part in parts)]
    program = folder / name
    subprocess.run([*locate_compiler(), *FLAGS, *map(str, objects(sources, headers)), "-o", str(program)], check=True)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_tasks_rest_whatever_waits(chip: str, tmp_path: Path) -> None:
    run_parts("rests", ("main/run.c", "app/motion_task.c"), chip, tmp_path)


def test_a_panic_switches_outputs_off_first(tmp_path: Path) -> None:
    run_parts("panic", ("main/panic.c", "app/restart_note.c"), "esp32", tmp_path)
    assert "--wrap=esp_panic_handler" in (ESP32 / "main" / "CMakeLists.txt").read_text()


def test_all_random_numbers_come_from_the_seed_that_is_drawn_first() -> None:
    """The generator is asked in one file, and the start draws before the storage, the pins (I2S) and the network."""
    asks = re.compile(r"\besp_(fill_)?random\b")
    sources = [path for path in ESP32.rglob("*.c") if "test" not in path.relative_to(ESP32).parts]
    assert [path.name for path in sources if asks.search(path.read_text())] == ["entropy.c"]
    start = (ESP32 / "main" / "main.c").read_text().partition("void app_main(void)")[2]
    calls = re.findall(r"\b(\w+)\(", start)
    assert calls[0] == "entropy_start"
