"""Virtual chips: a board's real firmware image runs in an emulated ESP32, ESP32-S3 or PIC32MZ.

All that others use is named here and in `wificnc_chips.esp32` and `wificnc_chips.pic32mz`, the chips themselves; other
modules are private. Time is the chip's own: `_s` are its seconds, `cycles` its clock's at `cpu_hz`. Pins are numbers:
those of `pin_numbers()`. `wificnc sim --on-chip`, `serve --on-chip` and `flash --verify-boot` are its commands.
"""

from wificnc_chips.fault import ChipFault
from wificnc_chips.job import ChipResult, Pace, as_axes, difference, paths, run_on_chip
from wificnc_chips.serve import ChipServer
from wificnc_chips.slirp import has_slirp
from wificnc_chips.verify import Verified, verify_boot
from wificnc_chips.version import __version__
from wificnc_chips.wired import Wired, greet, pin_numbers, wire

__all__ = [
    "ChipFault",
    "ChipResult",
    "ChipServer",
    "Pace",
    "Verified",
    "Wired",
    "__version__",
    "as_axes",
    "difference",
    "greet",
    "has_slirp",
    "paths",
    "pin_numbers",
    "run_on_chip",
    "verify_boot",
    "wire",
]
