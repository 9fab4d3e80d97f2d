"""What the firmware of an ESP32 takes of its slot and of the memory for instructions, read from the linker's file."""

from __future__ import annotations

import struct
from pathlib import Path

from wificnc.build.size import Size
from wificnc.errors import BuildError

IMAGE_BUDGET = 1_468_006  # 1.4 MB, in a slot of 1.875 MB
IRAM_BUDGET_SHARE = 0.85

_ELF32_LITTLE = b"\x7fELF\x01\x01"
_SECTION = struct.Struct("<10I")
_ALLOCATED = 2  # SHF_ALLOC

# components/esp_system/ld/CHIP/memory.ld.in of ESP-IDF v5.5.3
_ESP32_IRAM = (0x40080000, 0x400A0000)
_S3_IRAM = (0x40370000, 0x403CB700)
_S3_SHARED = 0x40378000  # from here on the same memory is data RAM, too
_S3_DRAM = (0x3FC88000, 0x3FC88000 + _S3_IRAM[1] - _S3_SHARED)


def firmware_sizes(folder: Path, chip: str, slot: int) -> list[Size]:
    """Of firmware.bin and firmware.elf in build/BOARD. Raises BuildError: the ELF is none of this chip."""
    used, there = iram(folder / "firmware.elf", chip)
    image = (folder / "firmware.bin").stat().st_size
    return [Size("image", image, slot, IMAGE_BUDGET), Size("IRAM", used, there, int(there * IRAM_BUDGET_SHARE))]


def iram(elf: Path, chip: str) -> tuple[int, int]:
    """Bytes of instruction RAM that are used, and that there are. The ESP32-S3 has instructions and static data in
    one memory, so data counts there, too: .dram0.dummy covers what instructions take of it. Raises BuildError."""
    found = _sections(elf)
    if chip == "esp32":
        used, there = _end(found, _ESP32_IRAM) - _ESP32_IRAM[0], _ESP32_IRAM[1] - _ESP32_IRAM[0]
    else:
        code = [place for place in found if _S3_IRAM[0] <= place[0] < _S3_IRAM[1]]
        origin = min((start for start, _ in code), default=_S3_IRAM[0])  # the cache takes 16 or 32 KB before it
        data = _end(found, _S3_DRAM) - _S3_DRAM[0]
        used = max(_end(found, _S3_IRAM) - origin, _S3_SHARED - origin + data) if code else 0
        there = _S3_IRAM[1] - origin
    if used <= 0:
        raise BuildError(f"{elf} is for another chip: it has no instructions in the RAM of an {chip}")
    return used, there


def _sections(elf: Path) -> list[tuple[int, int]]:
    """Start and end of each section that takes memory. Raises BuildError."""
    data = elf.read_bytes()
    try:
        if not data.startswith(_ELF32_LITTLE):
            raise struct.error
        (table,) = struct.unpack_from("<I", data, 32)
        size, count = struct.unpack_from("<2H", data, 46)
        rows = [_SECTION.unpack_from(data, table + n * size) for n in range(count)]
    except struct.error:
        raise BuildError(f"{elf} is not a firmware in ELF format, or it is cut off") from None
    return [(row[3], row[3] + row[5]) for row in rows if row[2] & _ALLOCATED and row[5]]


def _end(sections: list[tuple[int, int]], region: tuple[int, int]) -> int:
    return max((end for start, end in sections if region[0] <= start < region[1]), default=region[0])
