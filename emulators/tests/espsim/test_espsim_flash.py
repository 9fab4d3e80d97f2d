"""The flash chip by the registers of SPI1, its pages in the address space, and what a power cut leaves."""

from __future__ import annotations

import images
import pytest
from registers import PLACES, Registers
from wificnc_chips.esp32.chip import Chip, Cpu, Stop, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

MS = 240_000
PLACE = 0x300000  # in flash, in no partition
USER_COMMAND, USER_ADDRESS, USER_MISO, USER_MOSI = 1 << 31, 1 << 30, 1 << 28, 1 << 27
RDSR, RDID, WREN, PP, SE, READ = 0x05, 0x9F, 0x06, 0x02, 0x20, 0x03
BUSY, ENABLED = 1, 2

# user, user1, user2, mosi, miso, data
SPI1 = {
    Chip.ESP32: (0x3FF42000, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x80),
    Chip.ESP32S3: (0x60002000, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x58),
}
CODE = {Chip.ESP32: 0x40080400, Chip.ESP32S3: 0x403C0400}
FLASH_DATA = {Chip.ESP32: 0x3F400000, Chip.ESP32S3: 0x3C000000}
FLASH_CODE = {Chip.ESP32: 0x400D0000, Chip.ESP32S3: 0x42010000}
MMU = {Chip.ESP32: (0x3FF10000, 0), Chip.ESP32S3: (0x600C5000, 0)}  # table, entry of the first data page
CACHE = 0x3FF00040
CONSTANTS = bytes(range(1, 201))


def application(kind: Chip) -> bytes:
    """A segment in RAM, one that flash maps as data."""
    pieces = [(CODE[kind], c.jump(0) + b"\0"), *images.mapped((FLASH_DATA[kind] + 0x20, CONSTANTS), 24 + 8 + 4)]
    return images.image(CODE[kind], pieces, chip=images.CHIP_IDS[kind])


class Flash(Registers):
    """With commands of the flash chip, as ESP-IDF's driver sends them."""

    def __init__(self, chip: VirtualChip, kind: Chip) -> None:
        super().__init__(chip, kind)
        self.kind = kind
        self.base, *self.places = SPI1[kind]

    def command(self, code: int, address: int | None = None, out: bytes = b"", read: int = 0) -> bytes:
        user, user1, user2, mosi, miso, data = (self.base + place for place in self.places)
        has = USER_COMMAND | USER_ADDRESS * (address is not None) | USER_MOSI * bool(out) | USER_MISO * bool(read)
        self.store(user, has)
        self.store(user1, 23 << 26)
        self.store(user2, 7 << 28 | code)
        if address is not None:
            self.store(self.base + 4, address << 8 | 0xFF if self.kind == Chip.ESP32 else address)
        self.store(mosi, 8 * len(out) - 1 if out else 0)
        self.store(miso, 8 * read - 1 if read else 0)
        for at in range(0, len(out), 4):
            self.store(data + at, int.from_bytes(out[at : at + 4], "little"))
        self.store(self.base, 1 << 18)
        words = [self.load(data + at).to_bytes(4, "little") for at in range(0, read, 4)]
        return b"".join(words)[:read]

    def status(self) -> int:
        return self.command(RDSR, read=1)[0]

    def operate(self, code: int, address: int, out: bytes = b"") -> None:
        """A write or an erase, and wait for its end."""
        self.command(WREN)
        self.command(code, address, out)
        while self.status() & BUSY:
            self.wait(MS // 10)


@pytest.fixture
def flash(chip: VirtualChip, request: pytest.FixtureRequest) -> Flash:
    kind = request.node.callspec.params["chip"]
    chip.load(images.merged(kind, application(kind)))
    return Flash(chip, kind)


def test_the_chip_says_what_it_is(flash: Flash) -> None:
    """Manufacturer, type, and 2^22 bytes."""
    assert flash.command(RDID, read=3) == b"\xef\x40\x16"


def test_there_is_nothing_to_resume(flash: Flash) -> None:
    """The bootloader resumes what it does not know of, before it reads."""
    flash.command(0x7A)
    assert flash.status() == 0


def test_a_merged_image_starts(flash: Flash) -> None:
    kind = flash.kind
    flash.chip.boot()
    assert flash.chip.cpu().pc == CODE[kind]
    assert flash.chip.read(FLASH_DATA[kind] + 0x20, len(CONSTANTS)) == CONSTANTS


def test_the_bootloader_in_flash_can_be_run(flash: Flash) -> None:
    """It has nothing mapped."""
    flash.chip.boot(bootloader=True)
    assert flash.chip.cpu().pc == images.BOOTLOADER_CODE[flash.kind]
    with pytest.raises(ValueError, match="no memory"):
        flash.chip.read(FLASH_DATA[flash.kind] + 0x20, 4)
    flash.chip.boot()
    assert flash.chip.cpu().pc == CODE[flash.kind]


def test_an_application_alone_starts(chip: VirtualChip, request: pytest.FixtureRequest) -> None:
    kind = request.node.callspec.params["chip"]
    chip.load(application(kind))
    assert chip.cpu().pc == CODE[kind] and chip.read(FLASH_DATA[kind] + 0x20, len(CONSTANTS)) == CONSTANTS


def test_code_and_constants_of_the_s3_need_pages_of_their_own() -> None:
    """One table maps both buses: ESP-IDF's linker script puts constants behind code."""
    code = images.mapped((0x42000020, bytes(64)))
    data = images.mapped((0x3C000020, bytes(64)), 24 + sum(8 + len(piece) for _, piece in code))
    with VirtualChip(Chip.ESP32S3) as chip, pytest.raises(ChipFault, match="42000020 and 3c000020 need the same page"):
        chip.load(images.image(0x42000020, [*code, *data], chip=9))


def test_a_program_clears_bits_and_an_erase_sets_them(flash: Flash) -> None:
    flash.operate(PP, PLACE + 16, b"\xf0\x55")
    flash.operate(PP, PLACE + 16, b"\x3c\xff")
    assert flash.command(READ, PLACE + 15, read=4) == b"\xff\x30\x55\xff"
    flash.operate(SE, PLACE + 0x123)
    assert flash.chip.flash()[PLACE : PLACE + 4096] == b"\xff" * 4096


def test_a_program_wraps_in_its_page(flash: Flash) -> None:
    flash.operate(PP, PLACE + 254, b"\x01\x02\x03\x04")
    assert flash.command(READ, PLACE + 254, read=4) == b"\x01\x02\xff\xff"
    assert flash.command(READ, PLACE, read=2) == b"\x03\x04"


def test_nothing_is_written_without_write_enable(flash: Flash) -> None:
    flash.command(PP, PLACE, b"\0")
    assert flash.chip.flash()[PLACE] == 0xFF and flash.chip.flash_operations == 0
    flash.command(WREN)
    assert flash.status() == ENABLED
    flash.command(PP, PLACE, b"\0")
    assert flash.status() == BUSY
    flash.wait(MS)
    assert flash.status() == 0 and flash.chip.flash()[PLACE] == 0


def test_a_busy_chip_answers_its_status_alone(flash: Flash) -> None:
    flash.command(WREN)
    flash.command(SE, PLACE)
    with pytest.raises(ChipFault, match="the flash chip gets the command 03 while it is busy"):
        flash.command(READ, PLACE, read=4)


@pytest.mark.parametrize(
    ("torn", "left"), [(0, b"\xff\xff\xff\xff"), (1, b"\x11\x22\x77\xff"), (2, b"\x11\x22\x33\x44")]
)
def test_a_power_cut_in_a_write(flash: Flash, torn: int, left: bytes) -> None:
    """0x77: 0x33 & 0xaa | 0xff & 0x55. What was written before is whole, and the next power-on starts."""
    flash.operate(PP, PLACE + 256, b"first")
    flash.chip.cut_power(1, torn)
    flash.command(WREN)
    assert flash.chip.run(1) == Stop.TIME
    flash.command(PP, PLACE, b"\x11\x22\x33\x44")
    assert flash.chip.run(1000) == Stop.DARK
    assert flash.chip.flash()[PLACE : PLACE + 4] == left
    assert flash.chip.flash()[PLACE + 256 : PLACE + 261] == b"first"
    flash.chip.boot()
    assert flash.status() == 0 and flash.command(READ, PLACE, read=4) == left


def test_a_power_cut_in_an_erase(flash: Flash) -> None:
    flash.chip.write_flash(PLACE, bytes(8192))
    flash.chip.cut_power(1, 1)
    flash.command(WREN)
    flash.command(SE, PLACE)
    now = flash.chip.flash()[PLACE : PLACE + 8192]
    assert now == b"\xff" * 2048 + b"\xaa" + bytes(8192 - 2049)


# ---- pages ----


def map_page(flash: Flash, page: int, place: int) -> None:
    table, first = MMU[flash.kind]
    flash.store(table + 4 * (first + page), place >> 16)


def test_pages_are_mapped(flash: Flash) -> None:
    flash.chip.write_flash(PLACE + 100, b"mapped..")
    map_page(flash, 5, PLACE)
    address = FLASH_DATA[flash.kind] + 5 * 0x10000 + 100
    assert flash.chip.read(address, 8) == b"mapped.."
    assert flash.load(address) == int.from_bytes(b"mapp", "little")
    flash.operate(PP, PLACE + 100, bytes(4))
    assert flash.load(address) == 0
    map_page(flash, 5, 0x4000 << 16 if flash.kind == Chip.ESP32S3 else 0x100 << 16)
    with pytest.raises(ChipFault, match=f"load from {address:08x}, where no flash is mapped, by the instruction at"):
        flash.load(address)


def test_code_in_flash_is_what_is_mapped_now(flash: Flash) -> None:
    """Two pages with another instruction each: what was decoded for one is not executed for the other."""
    places = (PLACE, PLACE + 0x10000)
    for place, value in zip(places, (11, 22), strict=True):
        flash.chip.write_flash(place, c.movi(4, value) + c.jump(0))
    address = FLASH_CODE[flash.kind]
    table = MMU[flash.kind][0]
    entry = 64 + 13 if flash.kind == Chip.ESP32 else 1
    for place, value in (*zip(places, (11, 22), strict=True), (places[0], 11)):
        flash.store(table + 4 * entry, place >> 16)
        flash.chip.set_cpu(Cpu(pc=address, ps=15, vecbase=PLACES[flash.kind].vectors, windowstart=1))
        flash.chip.run(10)
        assert flash.chip.cpu().a[4] == value


def test_flash_is_not_there_while_the_cache_is_off(esp32: VirtualChip) -> None:
    esp32.load(images.merged(0, application(Chip.ESP32)))
    flash = Flash(esp32, Chip.ESP32)
    address = FLASH_DATA[Chip.ESP32] + 0x20
    flash.store(CACHE, 0)
    flash.store(CACHE, 1 << 3)
    assert flash.load(address) == 0x04030201
    flash.store(CACHE, 0)
    with pytest.raises(ChipFault, match=f"load from {address:08x}, which is flash, while its cache is off, by the"):
        flash.load(address)


def test_the_cache_needs_an_idle_chip(esp32: VirtualChip) -> None:
    esp32.load(images.merged(0, application(Chip.ESP32)))
    flash = Flash(esp32, Chip.ESP32)
    flash.store(CACHE, 0)
    flash.command(WREN)
    flash.command(SE, PLACE)
    with pytest.raises(ChipFault, match="the cache is turned on while the flash chip writes or erases"):
        flash.store(CACHE, 1 << 3)


def test_an_application_is_called(esp32: VirtualChip) -> None:
    """By call8, with windows: a function that calls itself 20 deep comes back, by the boot ROM's vectors."""
    begin = 0x40080400
    function = begin + 32
    main = c.entry(1, 32) + c.movi(10, 20) + c.call(8, begin + 6, function) + c.movi(5, 77) + c.jump(0)
    rest = c.addi(10, 2, -1) + c.call(8, function + 9, function)
    skip = (6 | 1 << 4 | 2 << 8 | (len(rest) - 1) << 12).to_bytes(3, "little")  # beqz a2 over the rest
    program = c.padded(main, 32) + c.entry(1, 32) + skip + rest + c.RETW
    esp32.load(images.image(begin, [(begin, program + bytes(-len(program) % 4))]))
    esp32.run(2000)
    assert (esp32.cpu().a[5], esp32.cpu().pc) == (77, begin + 12)


# ---- which application starts ----


def numbered(number: int) -> bytes:
    return images.image(0x40080400, [(0x40080400, c.jump(0) + b"\0"), (0x3FFB0000, number.to_bytes(4, "little"))])


def started(chip: VirtualChip) -> int:
    return int.from_bytes(chip.read(0x3FFB0000, 4), "little")


def with_otadata(*entries: bytes, second: bytes | None = None) -> bytes:
    more = [(images.OTADATA_AT + 4096 * n, entry) for n, entry in enumerate(entries)]
    return images.merged(0, numbered(1), more=[*more, (images.OTA_1, numbered(2) if second is None else second)])


CHOICES = [
    ((), 1),
    ((images.otadata(1),), 1),
    ((images.otadata(2),), 2),
    ((images.otadata(1), images.otadata(2)), 2),
    ((images.otadata(3), images.otadata(2)), 1),
    ((images.otadata(3)[:-1] + b"\0", images.otadata(2)), 2),
    ((images.otadata(1), images.otadata(2, images.INVALID)), 1),
    ((images.otadata(1), images.otadata(2, images.ABORTED)), 1),
]


@pytest.mark.parametrize(("entries", "number"), CHOICES)
def test_otadata_names_the_application(esp32: VirtualChip, entries: tuple[bytes, ...], number: int) -> None:
    esp32.load(with_otadata(*entries))
    assert started(esp32) == number


def test_a_new_application_has_one_trial(esp32: VirtualChip) -> None:
    """It starts once; it has to become valid before the next start."""
    esp32.load(with_otadata(images.otadata(1, images.VALID), images.otadata(2, images.NEW)))
    assert started(esp32) == 2
    esp32.boot()
    assert started(esp32) == 1
    esp32.boot()
    assert started(esp32) == 1


def test_a_damaged_application_gives_way(esp32: VirtualChip) -> None:
    damaged = numbered(2)[:-1] + b"?"
    esp32.load(with_otadata(images.otadata(1), images.otadata(2), second=damaged))
    assert started(esp32) == 1


def test_a_peripheral_that_is_not_emulated_is_noted(flash: Flash) -> None:
    """Once. Firmware sets up all that its board has; its pin stays low."""
    at = flash.at
    for _ in range(2):
        flash.store(at.gpio + at.outputs + 4 * 4, 96)
    flash.store(at.gpio + 0x24, 1 << 4)
    flash.store(at.gpio + 0x08, 1 << 4)
    assert flash.chip.notes == ["GPIO 4 is routed to the signal 96, which is not emulated: it stays low"]
    assert flash.chip.level(4) == 0
