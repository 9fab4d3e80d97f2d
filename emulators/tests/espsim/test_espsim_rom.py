"""Functions of the boot ROM against Python's: strings, numbers, digests, output."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from registers import PLACES, Registers
from wificnc_chips.esp32.chip import Chip, Cpu, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain
from xtensa_programs import bare, romcode
from xtensa_programs import code as c

DATA = {Chip.ESP32: 0x3FFB0000, Chip.ESP32S3: 0x3FCA0000}
WORDS = 2**32


class Rom:
    """Calls with arguments in a10 and on, as from windowed code; strings lie in data RAM."""

    def __init__(self, chip: VirtualChip, kind: Chip) -> None:
        self.chip, self.kind = chip, kind
        self.data = DATA[kind]
        self.functions = bare.rom_functions(kind)
        self.free = self.data + 0x1000

    def put(self, text: bytes, room: int = 64) -> int:
        place, self.free = self.free, self.free + max(room, len(text) + 1)
        self.chip.write(place, text + b"\0")
        return place

    def text(self, place: int) -> bytes:
        return self.chip.read(place, 64).split(b"\0")[0]

    def call(self, name: str, *arguments: int | bytes) -> int:
        at = PLACES[self.kind].code
        self.chip.write(at, c.wide(0, 14, 3) + c.jump(0))  # callx8 a3
        cpu = Cpu(pc=at, ps=0x40020, vecbase=PLACES[self.kind].vectors, windowstart=1)
        cpu.a[1], cpu.a[3] = self.data + 0x800, self.functions[name]
        words = [self.put(word) if isinstance(word, bytes) else word % WORDS for word in arguments]
        for n, word in enumerate(words[:6]):
            cpu.a[10 + n] = word
        for n, word in enumerate(words[6:]):
            self.chip.write(self.data + 0x800 + 4 * n, word.to_bytes(4, "little"))
        self.chip.set_cpu(cpu)
        self.chip.run(20_000)
        assert self.chip.cpu().pc == at + 3
        return int(self.chip.cpu().a[10])


@pytest.fixture
def rom(chip: VirtualChip, request: pytest.FixtureRequest) -> Rom:
    return Rom(chip, Chip(request.node.callspec.params["chip"]))


def test_copies(rom: Rom) -> None:
    for name, arguments, left in (
        ("strcpy", (b"abc",), b"abc"),
        ("strncpy", (b"abc", 2), b"abXXXXXXX"),
        ("strncpy", (b"abc", 6), b"abc"),
        ("strcat", (b"abc",), b"XXXXXXXXXabc"),
        ("strncat", (b"abc", 2), b"XXXXXXXXXab"),
    ):
        to = rom.put(b"X" * 9)
        assert rom.call(name, to, *arguments) == to
        assert rom.text(to) == left
    to = rom.put(b"X" * 9)
    rom.call("strncpy", to, b"ab", 6)
    assert rom.chip.read(to, 9) == b"ab\0\0\0\0XXX"


def test_limited_copies_end_in_their_room(rom: Rom) -> None:
    """They return the length that there would have been."""
    to = rom.put(b"12345")
    assert (rom.call("strlcpy", to, b"abcdef", 4), rom.text(to)) == (6, b"abc")
    assert (rom.call("strlcat", to, b"xyz", 6), rom.text(to)) == (6, b"abcxy")
    assert rom.chip.read(to + 6, 1) != b"z"


@pytest.mark.parametrize("name", ["strchr", "strrchr"])
@pytest.mark.parametrize("byte", [b"a", b"n", b"x"])
def test_searches_of_a_byte(rom: Rom, name: str, byte: bytes) -> None:
    text = b"banana"
    at = rom.put(text)
    place = text.find(byte) if name == "strchr" else text.rfind(byte)
    assert rom.call(name, at, ord(byte)) == (at + place if place >= 0 else 0)
    assert rom.call("strchr", at, 0) == at + len(text)


@pytest.mark.parametrize("part", [b"nan", b"na", b"", b"nab", b"ananas"])
def test_searches_of_a_text(rom: Rom, part: bytes) -> None:
    text = b"banana"
    at = rom.put(text)
    place = text.find(part)
    assert rom.call("strstr", at, part) == (at + place if place >= 0 else 0)


def test_spans(rom: Rom) -> None:
    assert rom.call("strspn", b"0012x0", b"012") == 4
    assert rom.call("strcspn", b"key=value", b"=;") == 3
    assert rom.call("strcspn", b"key", b"=;") == 3


def test_comparisons_without_case(rom: Rom) -> None:
    assert rom.call("strcasecmp", b"WiFi", b"wIfI") == 0
    assert rom.call("strncasecmp", b"WiFi-A", b"wifi-B", 5) == 0
    assert rom.call("strcasecmp", b"a", b"B") >= 2**31


@pytest.mark.parametrize(
    ("text", "base", "number", "used"),
    [
        (b" 42;", 10, 42, 3),
        (b"-17", 0, -17, 3),
        (b"0x1fg", 0, 31, 4),
        (b"0xg", 0, 0, 1),
        (b"017", 0, 15, 3),
        (b"z", 36, 35, 1),
        (b"none", 10, 0, 0),
        (b"9999999999", 10, 2**31 - 1, 10),
        (b"-9999999999", 10, -(2**31), 11),
    ],
)
def test_numbers(rom: Rom, text: bytes, base: int, number: int, used: int) -> None:
    at, end = rom.put(text), rom.put(b"....")
    assert rom.call("strtol", at, end, base) == number % WORDS
    assert int.from_bytes(rom.chip.read(end, 4), "little") == at + used
    assert rom.call("strtoul", b"4294967295", 0, 10) == 2**32 - 1


def test_divisions_towards_zero(rom: Rom) -> None:
    for n, d in ((17, 5), (-17, 5), (17, -5), (-17, -5)):
        quotient = rom.call("div", n, d)
        assert quotient == int(n / d) % WORDS and int(rom.chip.cpu().a[11]) == (n - int(n / d) * d) % WORDS


def test_numbers_as_text(rom: Rom) -> None:
    to = rom.put(b"")
    for value, base, text in ((-17, 10, b"-17"), (255, 16, b"ff"), (-1, 16, b"ffffffff"), (0, 2, b"0")):
        assert rom.call("itoa", value, to, base) == to and rom.text(to) == text


def test_the_roms_window_vectors(chip: VirtualChip) -> None:
    """Programs use them until they have set VECBASE."""
    assert chip.read(0x40000000, 0x180) == c.window_vectors()


def test_qsort_calls_the_program(rom: Rom) -> None:
    """Elements of 4 bytes, by a comparison in the chip's memory: their difference."""
    compare = PLACES[rom.kind].code + 0x100
    rom.chip.write(compare, c.entry(1, 32) + c.l32i(2, 2, 0) + c.l32i(3, 3, 0) + c.wide(0, 3, 2, 2, 0, 12) + c.RETW)
    numbers = [5, 3, 9, 3, 1, 8, 2]
    at = rom.put(b"".join(number.to_bytes(4, "little") for number in numbers))
    rom.call("qsort", at, len(numbers), 4, compare)
    left = [int.from_bytes(rom.chip.read(at + 4 * n, 4), "little") for n in range(len(numbers))]
    assert left == sorted(numbers)


def test_crc8_of_the_mac_address(rom: Rom) -> None:
    """Polynomial 0x31, the lowest bit first: CRC-8/MAXIM, whose check value is a1."""
    assert rom.call("esp_crc8", b"123456789", 9) == 0xA1


def test_characters(rom: Rom) -> None:
    for name, right in (("isalpha", str.isalpha), ("isdigit", str.isdigit), ("isspace", str.isspace)):
        assert [bool(rom.call(name, byte)) for byte in range(33, 127)] == [right(chr(byte)) for byte in range(33, 127)]
    assert rom.call("toupper", ord("q")) == ord("Q") and rom.call("tolower", ord("[")) == ord("[")


def test_ctype_table(esp32: VirtualChip) -> None:
    """newlib's, with the character's classes one place on: bit 2 are digits."""
    table = esp32.read(0x3FF96354, 257)
    assert [n - 1 for n, bits in enumerate(table) if bits & 4] == list(range(48, 58))
    assert esp32.read(0x3FF96350, 4) == (0x3FF96354).to_bytes(4, "little")


def test_crc(rom: Rom) -> None:
    text = bytes(range(200)) * 3
    at = rom.put(text)
    assert rom.call("crc32_le", 0, at, len(text)) == zlib.crc32(text)
    assert rom.call("crc32_le", zlib.crc32(text[:100]), at + 100, len(text) - 100) == zlib.crc32(text)
    assert rom.call("crc32_le", 2**32 - 1, at, 4) == zlib.crc32(text[:4], 2**32 - 1)


@pytest.mark.parametrize("size", [0, 55, 56, 64, 200])
def test_md5(rom: Rom, size: int) -> None:
    text = bytes(range(256))[:size]
    context, digest, at = rom.put(b"", 88), rom.put(b"", 16), rom.put(text)
    rom.call("esp_rom_md5_init", context)
    rom.call("esp_rom_md5_update", context, at, size // 2)
    rom.call("esp_rom_md5_update", context, at + size // 2, size - size // 2)
    rom.call("esp_rom_md5_final", digest, context)
    assert rom.chip.read(digest, 16) == hashlib.md5(text).digest()


def test_printf(rom: Rom) -> None:
    """Arguments beyond the sixth are on the stack."""
    rom.call("ets_printf", b"%s %d %u|%5d|%05x|%c%%\n", b"text", -3, 2**32 - 1, 42, 0xAB, ord("!"))
    assert rom.chip.read_serial() == b"text -3 4294967295|   42|000ab|!%\r\n"


def test_interrupts_are_routed(rom: Rom) -> None:
    at = PLACES[rom.kind]
    rom.call("intr_matrix_set", 0, at.gpio_source, 19)
    rom.chip.write(at.code, c.l32i(3, 2, 0))
    cpu = Cpu(pc=at.code, ps=15, vecbase=at.vectors, windowstart=1)
    cpu.a[2] = at.matrix + 4 * at.gpio_source
    rom.chip.set_cpu(cpu)
    rom.chip.run(1)
    assert rom.chip.cpu().a[3] == 19


def test_analog_registers_keep_what_is_written(rom: Rom) -> None:
    """Bits 6 to 4 of one of them."""
    rom.call("rom_i2c_writeReg", 0x66, 4, 3, 0xFF)
    rom.call("rom_i2c_writeReg_Mask", 0x66, 4, 3, 6, 4, 0b010)
    assert rom.call("rom_i2c_readReg", 0x66, 4, 3) == 0xAF
    assert rom.call("rom_i2c_readReg_Mask", 0x66, 4, 3, 6, 4) == 0b010


def test_what_the_rom_cannot_read(rom: Rom) -> None:
    with pytest.raises(ChipFault, match="the boot ROM is to read 9 bytes at 70000000, where no memory is"):
        rom.call("crc32_le", 0, 0x70000000, 9)


def test_a_function_that_is_answered_for(rom: Rom) -> None:
    """Without executing it: there is no instruction at all."""
    rom.functions["esp_wifi_init"] = PLACES[rom.kind].code + 0x200
    rom.chip.answer(rom.functions["esp_wifi_init"], -1)
    assert rom.call("esp_wifi_init") == WORDS - 1


def test_symbols_of_another_file(esp32: VirtualChip) -> None:
    with pytest.raises(ValueError, match="not an ELF file for Xtensa"):
        esp32.load_symbols(b"\x7fELF")
    with pytest.raises(KeyError):
        esp32.symbol("main")


CALLS = 0x3FFAE024  # syscall_table_ptr_pro
GETREENT, WRITE_R, LOCK = 0, 21, 25  # places in the table: libc_stubs.h
STREAMS, FILE = 0x3FFAE300, 104


@pytest.fixture
def newlib(esp32: VirtualChip) -> Rom:
    """The program's functions: __getreent() returns 7, _write_r() the sum of its first and second argument."""
    rom = Rom(esp32, Chip.ESP32)
    at, table = PLACES[Chip.ESP32].code + 0x100, rom.data
    bodies = {GETREENT: c.movi(2, 7), WRITE_R: c.add(2, 2, 3), LOCK: c.movi(3, 9) + c.s32i(3, 2, 0)}
    for n, (place, body) in enumerate(bodies.items()):
        esp32.write(at + 32 * n, c.entry(1, 32) + body + c.RETW)
        esp32.write(table + 4 * place, (at + 32 * n).to_bytes(4, "little"))
    esp32.write(CALLS, table.to_bytes(4, "little"))
    return rom


def test_files_reach_the_programs_functions(newlib: Rom) -> None:
    """With the caller's reent before the file's number."""
    assert newlib.call("write", 3, 0, 0) == 7 + 3


def test_streams(newlib: Rom) -> None:
    """Eight; each is reserved, has its owner and a lock."""
    streams = [newlib.call("__sfp", newlib.data + 0x100) for _ in range(9)]
    assert streams == [*(STREAMS + FILE * n for n in range(8)), 0]
    words = newlib.chip.read(STREAMS, FILE)
    assert words[12:16] == b"\x01\0\xff\xff"
    assert words[28:32] == (newlib.data + 0x100).to_bytes(4, "little") and words[88] == 9


def test_tokens(newlib: Rom) -> None:
    text, rest = newlib.put(b" ;a;;bc "), newlib.put(b"....")
    places = [newlib.call("strtok_r", text, b"; ", rest)]
    places += [newlib.call("strtok_r", 0, b"; ", rest) for _ in range(2)]
    assert [newlib.text(place) if place else None for place in places] == [b"a", b"bc", None]


def test_the_roms_code_is_what_its_source_makes(tmp_path: Path) -> None:
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(tools):
        pytest.skip(said)
    made = romcode.header(romcode.build(tmp_path))
    assert made == romcode.OUTPUT.read_text(encoding="utf-8"), "run python -m xtensa_programs.romcode"


# ---- of the S3 ----

CALLS_S3, MALLOC_R = 0x3FCEFFD4, 1
DOG_RTC, DOG_GROUP_0, DOG_GROUP_1 = 0, 1, 2  # wdt_inst_t
GROUPS, RTC_DOG, DOG_AT = {DOG_GROUP_0: 0x6001F000, DOG_GROUP_1: 0x60020000}, 0x60008098, 0x48
INTERRUPT, RESET_CPU, RESET_SYSTEM, MS = 1, 2, 3, 240_000


@pytest.fixture
def s3() -> Iterator[Rom]:
    with VirtualChip(Chip.ESP32S3) as chip:
        yield Rom(chip, Chip.ESP32S3)


def test_strdup_of_the_s3_takes_memory_from_the_program(s3: Rom) -> None:
    """By its own table, at another place than the ESP32's."""
    room, at = s3.data + 0x900, PLACES[Chip.ESP32S3].code + 0x100
    malloc = c.l32r(2, at + 32 + 3, at - 8) + c.s32i(3, 2, 64)  # behind the text: the size that was wanted
    s3.chip.write(at - 8, room.to_bytes(4, "little"))
    for n, (place, body) in enumerate({GETREENT: c.movi(2, 7), MALLOC_R: malloc}.items()):
        s3.chip.write(at + 32 * n, c.entry(1, 32) + body + c.RETW)
        s3.chip.write(s3.data + 4 * place, (at + 32 * n).to_bytes(4, "little"))
    s3.chip.write(CALLS_S3, s3.data.to_bytes(4, "little"))
    assert s3.call("strdup", b"a name") == room
    assert s3.text(room) == b"a name" and s3.chip.read(room + 64, 4) == (7).to_bytes(4, "little")


def test_divisions_of_floats(s3: Rom) -> None:
    for a, b in ((1.0, 3.0), (-7.5, 0.25), (1e38, 1e-3)):
        words = [struct.unpack("<I", struct.pack("<f", x))[0] for x in (a, b)]
        with np.errstate(over="ignore"):
            wanted = np.float32(a) / np.float32(b)
        assert struct.pack("<I", s3.call("__divsf3", *words)) == struct.pack("<f", wanted)


def registers_of(rom: Rom) -> Registers:
    return Registers(rom.chip, Chip.ESP32S3)


@pytest.mark.parametrize("which", [DOG_GROUP_0, DOG_GROUP_1])
def test_a_watchdog_of_a_timer_group(s3: Rom, which: int) -> None:
    """wdt_hal.h: off after its init, locked for stores; a stage has its ticks and what it does; fed when enabled."""
    regs, hal, group = registers_of(s3), s3.data, GROUPS[which]
    s3.call("wdt_hal_init", hal, which, 40000, 1)
    assert s3.chip.read(hal, 8) == which.to_bytes(4, "little") + group.to_bytes(4, "little")
    assert s3.call("wdt_hal_is_enabled", hal) == 0 and regs.load(group + 0x70) & 4
    regs.store(group + DOG_AT + 8, 1)
    s3.call("wdt_hal_write_protect_disable", hal)
    s3.call("wdt_hal_config_stage", hal, 0, 4, INTERRUPT)
    s3.call("wdt_hal_enable", hal)
    s3.call("wdt_hal_write_protect_enable", hal)
    assert s3.call("wdt_hal_is_enabled", hal) == 1
    regs.wait(MS)
    assert not regs.load(group + 0x74) & 4
    regs.wait(2 * MS)  # 4 ticks of 40000 / 80 MHz
    assert regs.load(group + 0x74) & 4
    s3.call("wdt_hal_write_protect_disable", hal)
    s3.call("wdt_hal_handle_intr", hal)
    assert not regs.load(group + 0x74) & 4
    s3.call("wdt_hal_disable", hal)
    regs.wait(10 * MS)
    assert not regs.load(group + 0x74) & 4 and s3.call("wdt_hal_is_enabled", hal) == 0


def test_the_rtcs_watchdog(s3: Rom) -> None:
    """Its first stage is doubled by the chip, which the function halves: ticks are those of 150 kHz."""
    hal = s3.data
    s3.call("wdt_hal_init", hal, DOG_RTC, 0, 0)
    s3.call("wdt_hal_write_protect_disable", hal)
    s3.call("wdt_hal_config_stage", hal, 0, 300, RESET_SYSTEM)
    s3.call("wdt_hal_enable", hal)
    s3.call("wdt_hal_feed", hal)
    registers_of(s3).wait(2 * MS - 28_000)  # a call has taken 20,000
    with pytest.raises(ChipFault, match=r"the chip is reset \(RTC watchdog\)"):
        registers_of(s3).wait(16_000)


def test_a_watchdog_that_there_is_not_is_named(s3: Rom) -> None:
    with pytest.raises(ChipFault, match="the watchdog 3, which there is not"):
        s3.call("wdt_hal_init", s3.data, 3, 0, 0)
    s3 = Rom(VirtualChip(Chip.ESP32S3), Chip.ESP32S3)
    s3.call("wdt_hal_init", s3.data, DOG_GROUP_0, 40000, 0)
    with pytest.raises(ChipFault, match="to give stage 0 of a watchdog the action 4"):
        s3.call("wdt_hal_config_stage", s3.data, 0, 4, 4)


@pytest.mark.parametrize("size", [0, 1, 63, 64, 200])
def test_sha256_of_the_s3s_boot_rom(s3: Rom, size: int) -> None:
    """In two pieces, as the bootloader reads an image; its context is SHA_CTX, 216 bytes."""
    text, context, digest = bytes(range(size)), s3.data, s3.data + 0x200
    s3.chip.write(s3.data + 0x300, text + b"\0")
    assert s3.call("ets_sha_init", context, 2) == 0
    s3.chip.write(context + 216, b"behind it")
    s3.call("ets_sha_update", context, s3.data + 0x300, size // 3, 0)
    s3.call("ets_sha_update", context, s3.data + 0x300 + size // 3, size - size // 3, 0)
    assert s3.call("ets_sha_finish", context, digest) == 0
    assert s3.chip.read(digest, 32) == hashlib.sha256(text).digest()
    assert s3.chip.read(context + 216, 9) == b"behind it"
    with pytest.raises(ChipFault, match="SHA of type 0 is not emulated"):
        s3.call("ets_sha_init", context, 0)


def test_the_s3s_boot_rom_writes_flash(s3: Rom) -> None:
    """Over the end of a page; erased are 4096 bytes."""
    s3.chip.create_flash(1 << 20)
    s3.chip.write_flash(0x3000, bytes(0x3000))
    assert s3.call("esp_rom_spiflash_erase_sector", 4) == 0
    data = bytes(n % 250 for n in range(600))
    s3.chip.write(s3.data + 0x300, data)
    before = s3.chip.cycles
    assert s3.call("esp_rom_spiflash_write", 0x40F0, s3.data + 0x300, len(data)) == 0
    assert s3.chip.cycles - before >= 4 * 240 * 400  # four pages of 400 us
    flash = s3.chip.flash()
    assert flash[0x40F0 : 0x40F0 + 600] == data and flash[0x3FFF] == 0 and flash[0x5000] == 0
    assert flash[0x4000:0x40F0] == b"\xff" * 0xF0 and flash[0x4348:0x5000] == b"\xff" * 0xCB8
