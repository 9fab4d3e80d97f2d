"""What programs with emulated registers of an ESP32 are compiled with."""

from __future__ import annotations

from pathlib import Path

from wificnc.board.header import pin_header_text
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root

HERE = Path(__file__).parent
ROOT = checkout_root()
ESP32 = ROOT / "targets" / "esp32"
INCLUDES = (HERE / "registers", ESP32, ROOT / "targets" / "chip", ROOT / "core", ESP32 / "test" / "idf_api", HERE)
FLAGS = ("-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")


def chip_folder(board: Board, chip: str, folder: Path) -> Path:
    """A folder with the board's and the chip's generated headers. @param chip  whose registers they are"""
    return header_folder(pin_header_text(board), chip, folder)


def header_folder(header: str, chip: str, folder: Path) -> Path:
    """The same with this pin_config.h."""
    folder.mkdir(exist_ok=True)
    (folder / "pin_config.h").write_text(header)
    values = {
        f"CONFIG_IDF_TARGET_{chip.upper()}": 1,
        "CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ": 240,
        "CONFIG_FREERTOS_HZ": 1000,
    }
    (folder / "sdkconfig.h").write_text("".join(f"#define {name} {value}\n" for name, value in values.items()))
    return folder
