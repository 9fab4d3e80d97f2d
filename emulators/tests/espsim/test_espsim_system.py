"""Watchdogs, resets, the clocks of ESP-IDF's time, and what the chip is."""

from __future__ import annotations

import hashlib

import images
import pytest
from registers import Registers
from wificnc_chips.esp32.chip import CPU_HZ, Chip, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

MS = CPU_HZ // 1000
KEY, ENABLE = 0x50D83AA1, 1 << 31
INTERRUPT, RESET_SYSTEM = 1, 3
RTC = {Chip.ESP32: 0x3FF48000, Chip.ESP32S3: 0x60008000}
RTC_WATCHDOG = {Chip.ESP32: 0x8C, Chip.ESP32S3: 0x98}
RESET_STATE = {Chip.ESP32: 0x34, Chip.ESP32S3: 0x38}
STORE0 = {Chip.ESP32: 0x4C, Chip.ESP32S3: 0x50}
EFUSE_MAC = {Chip.ESP32: 0x3FF5A004, Chip.ESP32S3: 0x60007044}
RANDOM = {Chip.ESP32: 0x3FF75144, Chip.ESP32S3: 0x6003507C}
ENTRY = {Chip.ESP32: 0x40080400, Chip.ESP32S3: 0x403C0400}


@pytest.fixture
def kind(request: pytest.FixtureRequest) -> Chip:
    return Chip(request.node.callspec.params["chip"])


@pytest.fixture
def registers(chip: VirtualChip, kind: Chip) -> Registers:
    return Registers(chip, kind)


def flash_image(kind: Chip) -> bytes:
    """A program that does nothing, for ever."""
    entry = ENTRY[kind]
    return images.merged(kind, images.image(entry, [(entry, c.jump(0) + b"\0")], chip=images.CHIP_IDS[kind]))


# ---- watchdogs ----


def start_watchdog(registers: Registers, action: int, ms: int, group: int = 0) -> int:
    """One stage; its clock is 1 kHz... of 80 MHz / 40000 / 2. @return its first register"""
    dog = registers.at.timers + 0x1000 * group + 0x48
    registers.store(dog + 0x1C, KEY)
    registers.store(dog + 4, 40000 << 16)
    registers.store(dog + 8, 2 * ms)
    registers.store(dog, ENABLE | action << 29)
    registers.store(dog + 0x1C, 0)
    return dog


def interrupted(registers: Registers) -> bool:
    return bool(registers.load(registers.at.timers + registers.at.interrupts + 4) & 4)


def test_a_watchdog_interrupts(registers: Registers) -> None:
    """2 ms after the last feed, alone on its line."""
    at = registers.at
    registers.store(at.timers + at.interrupts, 4)
    registers.store(at.matrix + 4 * (at.source + 2), 19)
    dog = start_watchdog(registers, INTERRUPT, 2)
    registers.wait(MS)
    registers.store(dog + 0x1C, KEY)
    registers.store(dog + 0x18, 1)
    registers.wait(2 * MS - 10)
    assert not interrupted(registers)
    registers.wait(10)
    assert interrupted(registers) and registers.chip.cpu().interrupt == 1 << 19


def test_a_watchdog_is_fed_with_the_key_alone(registers: Registers) -> None:
    dog = start_watchdog(registers, INTERRUPT, 2)
    registers.wait(MS)
    registers.store(dog + 0x18, 1)
    registers.store(dog, 0)
    registers.wait(MS)
    assert interrupted(registers)


def test_a_watchdog_resets_the_chip(registers: Registers, kind: Chip) -> None:
    """Which starts again, with the cause in its register; pins are inputs again, RTC registers keep their words."""
    chip = registers.chip
    chip.load(flash_image(kind))
    registers.store(registers.at.gpio + 0x24, 1 << 4)
    registers.store(registers.at.gpio + 0x08, 1 << 4)
    registers.store(RTC[kind] + STORE0[kind], 0x12345678)
    start_watchdog(registers, RESET_SYSTEM, 2, group=1)
    registers.wait(2 * MS - 20)
    assert chip.resets == (0, "") and chip.level(4) == 1
    registers.wait(40)
    assert chip.resets == (1, "watchdog of timer group 1") and chip.level(4) == 0
    assert chip.cpu().pc == ENTRY[kind]
    assert registers.load(RTC[kind] + RESET_STATE[kind]) & 63 == 8
    assert registers.load(RTC[kind] + STORE0[kind]) == 0x12345678
    registers.wait(10 * MS)
    assert chip.resets[0] == 1


def test_the_rtc_watchdog_resets_the_chip(registers: Registers, kind: Chip) -> None:
    """By the slow clock of 150 kHz; the S3 doubles the first stage."""
    chip, dog = registers.chip, RTC[kind] + RTC_WATCHDOG[kind]
    chip.load(flash_image(kind))
    registers.store(dog + 0x18, KEY)
    registers.store(dog + 4, 300)
    registers.store(dog, ENABLE | 4 << 28)
    lasts = 2 * MS * (1 if kind == Chip.ESP32 else 2)
    registers.wait(lasts - 10)
    assert chip.resets[0] == 0
    registers.wait(20)
    assert chip.resets == (1, "RTC watchdog")
    assert registers.load(RTC[kind] + RESET_STATE[kind]) & 63 == 16


def test_software_resets_the_chip(registers: Registers, kind: Chip) -> None:
    registers.chip.load(flash_image(kind))
    registers.store(RTC[kind], 1 << 31)
    registers.wait(2)
    assert registers.chip.resets == (1, "software, the whole chip")
    assert registers.load(RTC[kind] + RESET_STATE[kind]) & 63 == 3


RESET_CPU, CPU_WATCHDOG, CPU_WATCHDOG_1, CPU_SOFTWARE, SOFTWARE = 2, 11, 17, 12, 3


@pytest.mark.parametrize(
    ("cause", "keeps"),
    [(CPU_SOFTWARE, True), (CPU_WATCHDOG, True), (CPU_WATCHDOG_1, True), (SOFTWARE, False)],
    ids=["cpu", "watchdog", "watchdog of group 1", "system"],
)
def test_a_reset_of_the_processors_leaves_the_pins(registers: Registers, kind: Chip, cause: int, keeps: bool) -> None:
    """Technical reference manuals, Reset and Clock: a CPU reset resets the cores alone, so GPIO keeps its levels. The
    S3 has a number for the watchdog of group 1 (soc/reset_reasons.h), the ESP32 that of group 0."""
    chip = registers.chip
    chip.load(flash_image(kind))
    registers.store(registers.at.gpio + 0x24, 1 << 4)
    registers.store(registers.at.gpio + 0x08, 1 << 4)
    if cause in (CPU_WATCHDOG, CPU_WATCHDOG_1):
        start_watchdog(registers, RESET_CPU, 1, group=int(cause == CPU_WATCHDOG_1))
        registers.wait(MS + 40)
    else:
        registers.store(RTC[kind], 1 << (5 if cause == CPU_SOFTWARE else 31))
        registers.wait(2)
    assert chip.resets[0] == 1 and chip.cpu().pc == ENTRY[kind]
    is_shared = cause == CPU_WATCHDOG_1 and kind == Chip.ESP32
    assert registers.load(RTC[kind] + RESET_STATE[kind]) & 63 == (CPU_WATCHDOG if is_shared else cause)
    assert chip.level(4) == int(keeps)
    registers.wait(MS)
    assert chip.level(4) == int(keeps)


def test_a_reset_without_flash_is_the_end(registers: Registers, kind: Chip) -> None:
    with pytest.raises(ChipFault, match=r"the chip is reset \(software\), and has no flash to start from"):
        registers.store(RTC[kind], 1 << 5)
        registers.wait(2)


def test_an_endless_boot_loop(chip: VirtualChip, kind: Chip) -> None:
    entry, reset = ENTRY[kind], RTC[kind]
    words = reset.to_bytes(4, "little") + (1 << 31).to_bytes(4, "little")
    program = c.l32r(2, entry + 8, entry) + c.l32r(3, entry + 11, entry + 4) + c.s32i(3, 2, 0) + c.jump(0)
    app = images.image(entry + 8, [(entry, words + program)], chip=images.CHIP_IDS[kind])
    chip.load(images.merged(kind, app))
    with pytest.raises(
        ChipFault, match="an endless boot loop: the chip was reset 8 times within seconds, the last time by: software"
    ):
        chip.run(CPU_HZ)


# ---- time ----


def test_rtc_time(registers: Registers, kind: Chip) -> None:
    registers.store(RTC[kind] + 0x0C, 1 << 31)
    begin = registers.load(RTC[kind] + 0x10)
    registers.wait(10 * MS)
    registers.store(RTC[kind] + 0x0C, 1 << 31)
    assert registers.load(RTC[kind] + 0x10) - begin in (1500, 1501)


def test_calibration_of_the_slow_clock(registers: Registers) -> None:
    """1024 of its periods, in those of the crystal: 150 kHz and 40 MHz."""
    timers = registers.at.timers
    registers.store(timers + 0x68, 1024 << 16 | 1 << 31)
    assert registers.load(timers + 0x68) & 1 << 15
    assert registers.load(timers + 0x6C) >> 7 == 1024 * 40_000_000 // 150_000


def test_an_alarm_reloads_its_timer(registers: Registers) -> None:
    """From the alarm on it counts from the loaded value; the alarm itself has to be set again."""
    at = registers.at
    registers.store(at.timers + 0x18, 7)
    registers.store(at.timers + 0x20, 1)
    registers.store(at.timers + 0x10, 107)
    registers.store(at.timers, 1 << 31 | 1 << 30 | 1 << 29 | 2 << 13 | 1 << 11 | 1 << 10)
    began = registers.chip.cycles
    registers.wait(1000)
    registers.store(at.timers + 0x0C, 1)
    passed = (registers.chip.cycles - 1 - began) // 6
    assert registers.load(at.timers + 0x04) == 7 + passed - 100
    assert not registers.load(at.timers) & 1 << 10


def test_lact(esp32: VirtualChip) -> None:
    """The ESP32's third timer of a group, from which esp_timer has microseconds: 80 MHz / 80; its alarm on line 17."""
    registers = Registers(esp32, Chip.ESP32)
    lact, at = registers.at.timers + 0x70, registers.at
    registers.store(at.matrix + 4 * 17, 19)
    registers.store(at.timers + at.interrupts, 8)
    registers.store(lact + 0x14, 1000)
    registers.store(lact, 1 << 31 | 1 << 30 | 80 << 13 | 1 << 11 | 1 << 10)
    registers.wait(MS - 5)
    assert not esp32.cpu().interrupt
    registers.wait(5)
    assert esp32.cpu().interrupt == 1 << 19
    registers.store(lact + 0x10, 1)
    assert registers.load(lact + 0x08) == 1000


SYSTIMER = 0x60023000


@pytest.fixture
def s3() -> Registers:
    chip = VirtualChip(Chip.ESP32S3)
    chip.timing(False)
    return Registers(chip, Chip.ESP32S3)


def systimer_count(registers: Registers, unit: int) -> int:
    registers.store(SYSTIMER + 4 + 4 * unit, 1 << 30)
    assert registers.load(SYSTIMER + 4 + 4 * unit) & 1 << 29
    high, low = (registers.load(SYSTIMER + 0x40 + 8 * unit + at) for at in (0, 4))
    return high << 32 | low


def test_systimer_counts(s3: Registers) -> None:
    """16 MHz; unit 1 has to be turned on, and begins at the value that was loaded."""
    begin = systimer_count(s3, 0)
    s3.wait(15 * 1000)
    assert systimer_count(s3, 0) - begin in (1000, 1001)
    s3.store(SYSTIMER + 0x14, 5)
    s3.store(SYSTIMER + 0x18, 3)
    s3.store(SYSTIMER + 0x60, 1)
    s3.wait(1000)
    assert systimer_count(s3, 1) == 5 << 32 | 3
    s3.store(SYSTIMER, 1 << 30 | 1 << 29)
    s3.wait(150)
    assert systimer_count(s3, 1) - (5 << 32 | 3) in (10, 11)


def test_systimer_alarms(s3: Registers) -> None:
    """At a count, once; in periods, again and again, without the delay of whoever clears them."""
    s3.store(s3.at.matrix + 4 * 58, 19)
    s3.store(SYSTIMER + 0x64, 7)
    target = systimer_count(s3, 0) + 2000
    s3.store(SYSTIMER + 0x28, target)
    s3.store(SYSTIMER + 0x54, 1)
    s3.store(SYSTIMER, 1 << 30 | 1 << 23)
    s3.wait(1900 * 15)
    assert not s3.chip.cpu().interrupt
    s3.wait(100 * 15)
    assert s3.chip.cpu().interrupt == 1 << 19
    s3.store(SYSTIMER + 0x38, 1 << 30 | 16000)
    s3.store(SYSTIMER + 0x54, 1)
    s3.store(SYSTIMER + 0x6C, 2)
    begin, counted = s3.chip.cycles, 0
    while s3.chip.cycles < begin + 10 * MS + 1000:
        s3.wait(500)
        if s3.load(SYSTIMER + 0x68) & 2:
            counted += 1
            s3.store(SYSTIMER + 0x6C, 2)
    assert counted == 10


def test_a_systimer_alarm_that_becomes_periodic(s3: Registers) -> None:
    """FreeRTOS on core 1: the period is applied and the alarm enabled as one at a time, then periods are chosen, while
    the counter counts."""
    s3.store(SYSTIMER, 1 << 30 | 1 << 23)
    s3.store(SYSTIMER + 0x38, 16000)
    s3.store(SYSTIMER + 0x54, 1)
    s3.store(SYSTIMER + 0x6C, 2)
    s3.store(SYSTIMER + 0x38, 1 << 30 | 16000)
    for _ in range(3):
        s3.wait(MS - 1000)
        assert not s3.load(SYSTIMER + 0x68) & 2
        s3.wait(1000)
        assert s3.load(SYSTIMER + 0x68) & 2
        s3.store(SYSTIMER + 0x6C, 2)


# ---- the S3's caches ----

EXTMEM, MAPPED = 0x600C4000, 0x3FF1FFFC


def test_the_s3s_caches_are_on_and_idle(s3: Registers) -> None:
    """What ESP-IDF waits for, and what it looks up before it turns them off."""
    assert s3.load(EXTMEM + 0x130) == 1 | 1 << 12
    assert s3.load(EXTMEM) & 1 == 1 and s3.load(EXTMEM + 0x60) & 1 == 1


def test_ram_of_the_s3s_boot_rom_is_named(s3: Registers) -> None:
    """ets_rom_layout_p: the heap ends at its second word."""
    layout = int.from_bytes(s3.chip.read(MAPPED, 4), "little")
    assert int.from_bytes(s3.chip.read(layout + 4, 4), "little") == 0x3FCED710


# ---- what the chip is ----


def test_the_mac_address(registers: Registers, kind: Chip) -> None:
    """Locally administered, for one device."""
    low, high = (registers.load(EFUSE_MAC[kind] + at) for at in (0, 4))
    mac = (high & 0xFFFF).to_bytes(2, "big") + low.to_bytes(4, "big")
    assert mac[0] & 3 == 2 and mac.hex() == "020000320001"


def sha256(registers: Registers, kind: Chip, text: bytes) -> bytes:
    """As ESP-IDF's driver does it, without DMA."""
    base, order = {Chip.ESP32: (0x3FF03000, "big"), Chip.ESP32S3: (0x6003B000, "little")}[kind]
    text_at, start, proceed, state = (0, 0x90, 0x94, 0) if kind == Chip.ESP32 else (0x80, 0x10, 0x14, 0x40)
    padded = text + b"\x80" + bytes(-(len(text) + 9) % 64) + (8 * len(text)).to_bytes(8, "big")
    if kind == Chip.ESP32S3:
        registers.store(base, 2)
    for at in range(0, len(padded), 64):
        for n in range(0, 64, 4):
            word = padded[at + n : at + n + 4]
            registers.store(base + text_at + n, int.from_bytes(word, "big" if order == "big" else "little"))
        registers.store(base + (proceed if at else start), 1)
    if kind == Chip.ESP32:
        registers.store(base + 0x98, 1)
    words = [registers.load(base + state + 4 * n) for n in range(8)]
    return b"".join(word.to_bytes(4, "big" if order == "big" else "little") for word in words)


@pytest.mark.parametrize("size", [0, 55, 56, 200])
def test_sha256(registers: Registers, kind: Chip, size: int) -> None:
    text = bytes(range(size))
    assert sha256(registers, kind, text) == hashlib.sha256(text).digest()


def test_random_numbers_differ(registers: Registers, kind: Chip) -> None:
    numbers = [registers.load(RANDOM[kind]) for _ in range(50)]
    assert len(set(numbers)) == 50


def test_registers_that_keep_what_is_written(registers: Registers, kind: Chip) -> None:
    """I2S1, as an example: nothing is done."""
    i2s1 = {Chip.ESP32: 0x3FF6D000, Chip.ESP32S3: 0x6002D000}[kind]
    registers.store(i2s1 + 0x10, 0xABCD)
    assert registers.load(i2s1 + 0x10) == 0xABCD


def test_uart_2_sends(registers: Registers, kind: Chip) -> None:
    uart = {Chip.ESP32: 0x3FF6E000, Chip.ESP32S3: 0x6002E000}[kind]
    registers.store(uart + 0x14, 40)
    registers.store(uart, ord("x"))
    registers.wait(1200)
    assert registers.chip.read_serial(2) == b"x" and registers.chip.read_serial() == b""


def test_the_esp32s_fifo_pointers(esp32: VirtualChip) -> None:
    """Bytes that its driver counts with: write pointer less read pointer. It writes bytes by the other bus."""
    registers = Registers(esp32, Chip.ESP32)
    uart = registers.at.uart
    registers.store(uart + 0x14, 40)
    esp32.write_serial(b"abcde")
    registers.wait(10 * 1200)
    registers.load(uart)
    status = registers.load(uart + 0x60)
    assert (status >> 13 & 0x7FF) - (status >> 2 & 0x7FF) == 4
    registers.store(0x60000000, ord("y"))
    registers.wait(1200)
    assert esp32.read_serial() == b"y"
