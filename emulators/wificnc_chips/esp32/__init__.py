"""The virtual ESP32 and ESP32-S3. Times are cycles of CPU_HZ.

`VirtualChip` is the bare chip; `EspMachine` has a board's motors, switches and shift registers at its pins, and an
image that `load_image()` has read.
"""

from wificnc_chips.esp32.chip import (
    CPU_HZ,
    SHIFT_FIRST,
    Chip,
    Core,
    Cpu,
    Level,
    Stop,
    VirtualChip,
)
from wificnc_chips.esp32.image import RADIO_MARK, EspImage, load_image
from wificnc_chips.esp32.machine import EspMachine, gpio

__all__ = [
    "CPU_HZ",
    "RADIO_MARK",
    "SHIFT_FIRST",
    "Chip",
    "Core",
    "Cpu",
    "EspImage",
    "EspMachine",
    "Level",
    "Stop",
    "VirtualChip",
    "gpio",
    "load_image",
]
