"""The image itself: what lies where, and the words that configure the chip."""

from __future__ import annotations

import struct

import pytest
from wificnc.build.image import Block, elf_symbols, read_elf, read_hex, write_hex
from wificnc.build.pic32mz import FLASH_BUDGET, RAM_BUDGET, Pic32Build
from wificnc.errors import BuildError

CONFIG = 0x1FC0FFC0
STORE = 0x1D180000

# DS60001320, Registers 34-3 to 34-6: field -> (lowest bit, width, value). Written down here a second time, from the
# data sheet and not from our header.
DEVCFG2 = {
    "FPLLIDIV: divide by 3": (0, 3, 2),
    "FPLLRNG: 5-10 MHz": (4, 3, 1),
    "FPLLICLK: primary oscillator": (7, 1, 0),
    "FPLLMULT: times 50": (8, 7, 49),
    "FPLLODIV: divide by 2": (16, 3, 1),
    "UPLLFSEL: 24 MHz": (30, 1, 1),
}
DEVCFG1 = {
    "FNOSC: system PLL": (0, 3, 1),
    "FSOSCEN: off": (6, 1, 0),
    "IESO: off": (7, 1, 0),
    "POSCMOD: external clock": (8, 2, 0),
    "OSCIOFNC: no clock output": (10, 1, 1),
    "FCKSM: monitor, no switching": (14, 2, 2),
    "WDTPS: 1:2048": (16, 5, 11),
    "WINDIS: no window": (22, 1, 1),
    "FWDTEN: by software": (23, 1, 0),
    "FDMTEN: off": (31, 1, 0),
}
DEVCFG0 = {
    "DEBUG: off": (0, 2, 3),
    "JTAGEN: off": (2, 1, 0),
    "ICESEL: PGEC2": (3, 2, 2),
    "TRCEN: off": (5, 1, 0),
    "BOOTISA: MIPS32": (6, 1, 1),
    "FECCCON: no ECC": (8, 2, 3),
    "SMCLR: system reset": (15, 1, 1),
    "EJTAGBEN: normal": (30, 1, 1),
}
DEVCFG3 = {"IOL1WAY: pins may be routed again": (29, 1, 0), "FUSBIDIO: by USB": (30, 1, 1)}

# r-1: reserved bits that must be programmed as 1
RESERVED = {"DEVCFG3": 0x84FF0000, "DEVCFG2": 0xBFF88008, "DEVCFG1": 0x00003800, "DEVCFG0": 0xBFC00880}


def config(image: tuple[Block, ...]) -> dict[str, int]:
    (block,) = [block for block in image if block.address == CONFIG]
    names = ("DEVCFG3", "DEVCFG2", "DEVCFG1", "DEVCFG0")
    return dict(zip(names, struct.unpack("<4I", block.data[:16]), strict=True))


@pytest.mark.parametrize(
    ("word", "fields"), [("DEVCFG3", DEVCFG3), ("DEVCFG2", DEVCFG2), ("DEVCFG1", DEVCFG1), ("DEVCFG0", DEVCFG0)]
)
def test_configuration_words(image: tuple[Block, ...], word: str, fields: dict[str, tuple[int, int, int]]) -> None:
    value = config(image)[word]
    assert value & RESERVED[word] == RESERVED[word]
    wrong = {what for what, (low, width, wanted) in fields.items() if value >> low & ((1 << width) - 1) != wanted}
    assert not wrong


def test_the_clock_is_200_mhz(image: tuple[Block, ...]) -> None:
    word = config(image)["DEVCFG2"]
    divide, multiply, out = (word & 7) + 1, (word >> 8 & 127) + 1, 1 << (word >> 16 & 7)
    into_pll, vco = 24_000_000 / divide, 24_000_000 / divide * multiply
    assert 5e6 <= into_pll <= 10e6 and 350e6 <= vco <= 700e6 and vco / out == 200_000_000


def test_everything_lies_where_it_may(image: tuple[Block, ...]) -> None:
    """Nothing in the settings' pages, nothing in the bootloader's, addresses physical."""
    regions = [(0x1D000000, 0x1D100000), (0x1FC00000, 0x1FC0FF40), (CONFIG, 0x1FC10000)]
    for block in image:
        assert any(low <= block.address and block.end <= high for low, high in regions), hex(block.address)
        assert block.end <= STORE or block.address >= 0x1FC00000


def test_boot_flash_has_a_reset_vector_and_nothing_else(image: tuple[Block, ...]) -> None:
    """16 bytes, which run wherever a bootloader puts them: they load an address and jump there."""
    (vector,) = [block for block in image if 0x1FC00000 <= block.address < CONFIG]
    lui, addiu, jump, nop = struct.unpack("<4I", vector.data)
    assert vector.address == 0x1FC00000
    assert (lui >> 26, addiu >> 26, jump & 0xFC1FFFFF, nop) == (0x0F, 0x09, 0x00000008, 0)
    low = (addiu & 0xFFFF) - ((addiu & 0x8000) << 1)
    target = ((lui & 0xFFFF) << 16) + low
    assert target >> 29 == 5  # KSEG1, not cached
    assert any(block.address <= target & 0x1FFFFFFF < block.end <= STORE for block in image)


def test_hex_says_what_elf_says(build: Pic32Build, image: tuple[Block, ...]) -> None:
    flash = {}
    for block in read_elf(build.elf.read_bytes()):
        flash.update({block.address + i: byte for i, byte in enumerate(block.data)})
    assert {b.address + i: byte for b in image for i, byte in enumerate(b.data)} == flash


def test_size(build: Pic32Build) -> None:
    assert build.flash_bytes <= FLASH_BUDGET and build.ram_bytes <= RAM_BUDGET


def test_data_is_copied_from_where_the_hex_has_it(build: Pic32Build, image: tuple[Block, ...]) -> None:
    """The load address of .data cannot drift from its section's."""
    symbols = elf_symbols(build.elf.read_bytes())
    size = symbols["_data_end"] - symbols["_data_start"]
    at = symbols["_data_lma"] & 0x1FFFFFFF
    assert size > 0 and any(block.address <= at and at + size <= block.end for block in image)


# ---- Intel HEX ----


def test_hex_of_a_known_block() -> None:
    """The example of the format's description: 16 bytes at 0x0100."""
    data = bytes.fromhex("214601360121470136007EFE09D21901")
    (line, end) = write_hex([Block(0x0100, data)]).split("\n")[1:3]
    assert line == ":10010000214601360121470136007EFE09D2190140"
    assert end == ":00000001FF"


@pytest.mark.parametrize("address", [0, 0x1D00FFF0, 0x1D00FFF8, 0x1FC0FFC1])
def test_hex_round_trip(address: int) -> None:
    block = Block(address, bytes(range(100)))
    assert read_hex(write_hex([block])) == (block,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (":00000001FE", "line 1 of the HEX file is damaged"),
        (":0200000412FFE9\n:0400000001020304F3\n:00000001FF", "line 2 of the HEX file is damaged"),
        ("0200000412FFE9", "line 1 of the HEX file is damaged"),
        (":0400000001020304F2", "it is cut off"),
        (":0400000312345678E5\n:00000001FF", "record type 3 is not known"),
    ],
)
def test_damaged_hex_is_refused(text: str, said: str) -> None:
    with pytest.raises(BuildError, match=said):
        read_hex(text)


def test_what_is_no_elf_is_refused() -> None:
    with pytest.raises(BuildError, match="not a 32-bit little-endian ELF"):
        read_elf(b"\x7fELF\x02\x01" + bytes(100))
