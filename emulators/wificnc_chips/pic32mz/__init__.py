"""The virtual PIC32MZ. Times are cycles of CPU_HZ, unless `cpu_speed()` or `timing()` has made them shorter.

`wired_chip()` makes a `VirtualChip` with a board's motors and switches at its pins; `board_image()` is what
`wificnc build` makes for it.
"""

from wificnc_chips.pic32mz.chip import (
    CPU_HZ,
    ESTIMATE,
    FLASH_SIZE,
    NO_PIN,
    STEP_DTYPE,
    Cpu,
    Stop,
    Timing,
    Torn,
    VirtualChip,
    pin_number,
)
from wificnc_chips.pic32mz.machine import (
    STORE_OFFSET,
    STORE_SIZE,
    board_image,
    load_store,
    motor_wire,
    wired_chip,
)

__all__ = [
    "CPU_HZ",
    "ESTIMATE",
    "FLASH_SIZE",
    "NO_PIN",
    "STEP_DTYPE",
    "STORE_OFFSET",
    "STORE_SIZE",
    "Cpu",
    "Stop",
    "Timing",
    "Torn",
    "VirtualChip",
    "board_image",
    "load_store",
    "motor_wire",
    "pin_number",
    "wired_chip",
]
