"""Sizes of an ESP32's firmware from made-up ELF files, against the budgets."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from wificnc.build.esp32_size import IMAGE_BUDGET, firmware_sizes, iram
from wificnc.commands.build import show_firmware
from wificnc.errors import BuildError

SLOT = 0x1E0000
KB = 1024


def elf(path: Path, sections: list[tuple[int, int]], flags: int = 2) -> Path:
    """A file with these sections (address, size) and one that takes no memory."""
    rows = [(0, 0, 0), *((flags, address, size) for address, size in sections), (0, 0x40080000, 1 << 20)]
    head = b"\x7fELF\x01\x01\x01" + bytes(9) + struct.pack("<2H5I6H", 2, 94, 1, 0, 0, 52, 0, 52, 0, 0, 40, len(rows), 0)
    table = b"".join(struct.pack("<10I", 0, 1, flag, address, 0, size, 0, 0, 0, 0) for flag, address, size in rows)
    path.write_bytes(head + table)
    return path


def build(folder: Path, image: int, sections: list[tuple[int, int]]) -> Path:
    elf(folder / "firmware.elf", sections)
    (folder / "firmware.bin").write_bytes(bytes(image))
    return folder


def test_esp32(tmp_path: Path) -> None:
    """Vectors, code after them, and data, flash and RTC memory, which are not IRAM."""
    sections = [
        (0x40080000, KB),
        (0x40080400, 95 * KB),
        (0x3FFB0000, 50 * KB),
        (0x400D0020, 700 * KB),
        (0x400C0000, 16),
    ]
    image, ram = firmware_sizes(build(tmp_path, 1_000_000, sections), "esp32", SLOT)
    assert (image.used, image.there, image.is_over) == (1_000_000, SLOT, False)
    assert (ram.used, ram.there, ram.is_over) == (96 * KB, 128 * KB, False)


@pytest.mark.parametrize(("image", "code", "over"), [
    (IMAGE_BUDGET, 1000, []), (IMAGE_BUDGET + 1, 1000, ["image"]),
    (1000, int(0.85 * 128 * KB), []), (1000, int(0.85 * 128 * KB) + 1, ["IRAM"]),
])  # fmt: skip
def test_budgets(tmp_path: Path, image: int, code: int, over: list[str]) -> None:
    sizes = firmware_sizes(build(tmp_path, image, [(0x40080000, code)]), "esp32", SLOT)
    assert [size.name for size in sizes if size.is_over] == over


@pytest.mark.parametrize(("image", "says"), [(1000, ""), (IMAGE_BUDGET + 1, "warning: image: more than the budget")])
def test_the_command_reports_a_budget(image: int, says: str, tmp_path: Path, capsys) -> None:
    show_firmware(firmware_sizes(build(tmp_path, image, [(0x40080000, KB)]), "esp32", SLOT), [])
    said = capsys.readouterr().err
    assert f"{image:,} of {SLOT:,} bytes" in said and says in said and ("warning" in said) == bool(says)


def test_what_does_not_fit_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="does not fit: image"):
        show_firmware(firmware_sizes(build(tmp_path, SLOT + 1, [(0x40080000, KB)]), "esp32", SLOT), [])


def test_budgets_are_what_the_page_says() -> None:
    assert round(IMAGE_BUDGET / 2**20, 3) == 1.4


@pytest.mark.parametrize("cache", [16 * KB, 32 * KB])
def test_esp32s3_has_code_and_data_in_one_memory(tmp_path: Path, cache: int) -> None:
    """100 KB of code; what of it is shared memory is covered by .dram0.dummy; 60 KB of data after that."""
    origin, code, data = 0x40370000 + cache, 100 * KB, 60 * KB
    dummy = origin + code - 0x40378000
    sections = [(origin, KB), (origin + KB, code - KB), (0x3FC88000, dummy), (0x3FC88000 + dummy, data)]
    used, there = iram(elf(tmp_path / "x.elf", sections), "esp32s3")
    assert (used, there) == (code + data, 0x403CB700 - origin)


@pytest.mark.parametrize("content", [b"", b"\x7fELF\x01\x01", b"MZ" + bytes(100), b"\x7fELF\x02\x01" + bytes(100)])
def test_what_is_no_elf_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "firmware.elf"
    path.write_bytes(content)
    with pytest.raises(BuildError, match="ELF"):
        iram(path, "esp32")


@pytest.mark.parametrize(("chip", "start"), [("esp32", 0x40374000), ("esp32s3", 0x40080000)])
def test_the_firmware_of_another_chip_is_refused(tmp_path: Path, chip: str, start: int) -> None:
    with pytest.raises(BuildError, match=chip):
        iram(elf(tmp_path / "x.elf", [(start, KB)]), chip)
