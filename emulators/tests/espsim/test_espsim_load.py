"""What the loader takes, and one clear line for each file that it does not."""

from __future__ import annotations

from typing import Any

import images
import pytest
from make_vectors import elf
from wificnc_chips.esp32.chip import Chip, VirtualChip
from wificnc_chips.fault import ChipFault

ENTRY, DATA = 0x40080400, 0x3FFB0000
CODE = bytes(range(32))
VALUES = b"some data that is 28 bytes.\0"


def image(
    *, chip: int = 0, pieces: tuple[tuple[int, bytes], ...] = ((ENTRY, CODE), (DATA, VALUES)), hashed: bool = True
) -> bytes:
    return images.image(ENTRY, pieces, chip=chip, hashed=hashed)


@pytest.mark.parametrize("hashed", [True, False])
def test_an_image_is_loaded(esp32: VirtualChip, hashed: bool) -> None:
    esp32.load(image(hashed=hashed))
    assert esp32.read(ENTRY, len(CODE)) == CODE and esp32.read(DATA, len(VALUES)) == VALUES
    assert esp32.cpu().pc == ENTRY


@pytest.mark.parametrize("size", [4, 48, 64, 100, 1000])
def test_hashes_of_any_length(esp32: VirtualChip, size: int) -> None:
    """The padding of SHA-256 at each place of its block."""
    for count in range(size, size + 64, 4):
        esp32.load(image(pieces=((DATA, bytes(count)),)))


def test_padding_segments_are_passed_over(esp32: VirtualChip) -> None:
    esp32.load(image(pieces=((0, bytes(16)), (ENTRY, CODE))))
    assert esp32.read(ENTRY, len(CODE)) == CODE


def flipped(text: bytes, at: int) -> bytes:
    return text[:at] + bytes((text[at] ^ 1,)) + text[at + 1 :]


def merged(**how: Any) -> bytes:
    return images.merged(0, image(), **how)


def table(*entries: bytes) -> bytes:
    return images.table(entries)


def signed() -> bytes:
    return image().ljust(0x1000, b"\xff") + b"\xe7\x02" + bytes(1214)


REFUSED = [
    (b"", "neither an ELF file nor an image of ESP-IDF"),
    (b"\x12" + image()[1:], "its first byte is 12, not e9.; encrypted images cannot be run"),
    (image(chip=9), "this image is for the ESP32-S3, not for the ESP32"),
    (image(chip=77), "this image is for the chip with number 77, not for the ESP32"),
    (image()[:20], "the image ends in its header"),
    (image()[:60], "the file ends in the middle of the segment for 40080400"),
    (image()[:-20], "the image is damaged: it ends after 124 of 144 bytes"),
    (flipped(image(), 35), "the image is damaged: its checksum is"),
    (flipped(image(), 4), "the image is damaged: its SHA-256 is another one"),
    (image() + b"x" * 9, "9 bytes follow the image's end"),
    (image(pieces=((0x3F400000, b"1234"),)), "is at 10020 in flash, which no page of 64 KB maps there"),
    (flipped(merged(), 0x1000), "its first byte is e8, not e9"),
    (flipped(merged(), 0x1021), "the image is damaged: its checksum is"),
    (flipped(merged(), 0x8004), "the partition table is damaged: its MD5 is another one"),
    (flipped(merged(), 0x8020), "the partition table is damaged: an entry does not begin with 50aa"),
    (flipped(merged(), images.OTA_0), "its first byte is e8, not e9.; encrypted images cannot be run"),
    (flipped(merged(), images.OTA_0 + 40), "the image is damaged: its checksum is"),
    (merged(parts=table(images.TABLE[0])), "the partition table has no application"),
    (
        merged(parts=table(images.partition(0, 0, 0x10000, 0x400000, b"factory"))),
        "the partition factory ends at 410000, but the flash has 400000 bytes .4 MB.; build for this size",
    ),
    (merged(parts=table(images.partition(0, 0, 0x10000, 0x10000, b"factory", 1))), "factory is encrypted"),
    (merged() + bytes(0x400000), "the merged image has [0-9]+ bytes, but its flash 4 MB"),
    (images.merged(0, signed()), "this image is signed for secure boot"),
    (image(pieces=((0x3F000000, b"1234"),)), "has no memory for 4 bytes at 3f000000"),
    (b"\x7fELF\x02".ljust(64, b"\0"), "this ELF file is not a program for Xtensa"),
    (elf([(DATA, b"1234"), (0x70000000, b"1")]), "has no memory for 1 bytes at 70000000"),
    (elf([(DATA, b"1234")])[:-2], "the file ends in the middle of the segment for 3ffb0000"),
]


@pytest.mark.parametrize(("text", "says"), REFUSED, ids=[f"file{n}" for n in range(len(REFUSED))])
def test_files_that_are_refused(esp32: VirtualChip, text: bytes, says: str) -> None:
    """And nothing is changed."""
    before = esp32.read(DATA, 4)
    with pytest.raises(ChipFault, match=says):
        esp32.load(text)
    assert esp32.read(DATA, 4) == before


def test_any_damage_is_found(esp32: VirtualChip) -> None:
    """Each bit of a hashed image."""
    good = image()
    for at in range(len(good)):
        with pytest.raises(ChipFault):
            esp32.load(flipped(good, at))


def test_a_segment_over_both_parts_of_the_s3s_iram() -> None:
    """The first 32 KB may be a cache, so they are a memory of their own; a linker fills both as one."""
    at, code = 0x40377FF0, bytes(range(64))
    with VirtualChip(Chip.ESP32S3) as chip:
        chip.load(images.image(at, [(at, code)], chip=9))
        assert chip.read(at, len(code)) == code
        assert chip.read(0x3FC88000, 48) == code[16:]
        with pytest.raises(ChipFault, match="no memory for 64 bytes at 403dffe0"):
            chip.load(images.image(at, [(0x403DFFE0, code)], chip=9))
