"""LEDC, MCPWM and RMT of the virtual chip: edges of pins, and formulas of the technical reference manuals.

A PWM's period is divider * counts / clock, its high part duty / counts of it. Registers are those of soc/*_reg.h.
"""

from __future__ import annotations

from dataclasses import dataclass

import images
import numpy as np
import pytest
from registers import Registers
from wificnc_chips.esp32.chip import CPU_HZ, Chip, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

PIN = 4
APB_HZ = 80_000_000


@pytest.fixture(params=list(Chip), ids=["esp32", "esp32s3"])
def kind(request: pytest.FixtureRequest) -> Chip:
    return Chip(request.param)


def route(regs: Registers, signal: int, inverted: bool = False) -> None:
    regs.store(regs.at.gpio + regs.at.outputs + 4 * PIN, signal | inverted << 9)
    regs.chip.record_edges()


def levels(chip: VirtualChip, pin: int = PIN) -> list[tuple[int, int]]:
    return [(cycle, level) for cycle, number, level in chip.edges() if number == pin]


def rises_and_highs(edges: list[tuple[int, int]]) -> tuple[list[int], list[int]]:
    """Cycles between rising edges, and of high parts."""
    if edges and edges[0][1] == 0:
        edges = edges[1:]
    rises = [cycle for cycle, level in edges if level]
    falls = [cycle for cycle, level in edges if not level]
    return list(np.diff(rises)), [fall - rise for rise, fall in zip(rises, falls, strict=False)]


# ---- LEDC ----


@dataclass(frozen=True)
class Ledc:
    base: int
    channels: int  # low speed channel 2, timer 2
    timer: int
    shift: int  # of the timer's fields, to the ESP32's
    conf: int
    signal: int


LEDC = {
    Chip.ESP32: Ledc(0x3FF59000, 0xA0, 0x170, 0, 0x190, 79 + 2),
    Chip.ESP32S3: Ledc(0x60019000, 0x00, 0xB0, 1, 0xD0, 73 + 2),
}


def ledc_timer(regs: Registers, kind: Chip, divider: int, bits: int) -> None:
    at = LEDC[kind]
    regs.store(at.base + at.conf, 1)  # APB
    tick_sel = 1 << 25 if kind == Chip.ESP32 else 0
    regs.store(at.base + at.timer, bits | divider << (5 - at.shift) | tick_sel | 1 << (26 - at.shift))


def ledc_duty(regs: Registers, kind: Chip, duty_sixteenths: int, hpoint: int = 0) -> None:
    at = LEDC[kind]
    channel = at.base + at.channels + 2 * 0x14
    regs.store(channel + 4, hpoint)
    regs.store(channel + 8, duty_sixteenths)
    regs.store(channel + 12, 1 << 31)
    regs.store(channel, 2 | 1 << 2 | 1 << 4)


@pytest.mark.parametrize(("divider", "bits", "duty"), [(256, 8, 64), (1000, 10, 512), (800, 4, 3), (2560, 10, 1023)])
def test_ledc_makes_its_formula(kind: Chip, divider: int, bits: int, duty: int) -> None:
    """Divider with eight bits of fraction; no rounding adds up."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        route(regs, LEDC[kind].signal)
        ledc_timer(regs, kind, divider, bits)
        ledc_duty(regs, kind, duty << 4)
        period = divider / 256 * 2**bits * CPU_HZ / APB_HZ
        chip.edges()
        regs.wait(round(20.5 * period))
        periods, highs = rises_and_highs(levels(chip)[2:])
        assert len(periods) >= 17
        assert np.abs(np.cumsum(periods) - period * np.arange(1, len(periods) + 1)).max() <= 1
        assert np.abs(np.array(highs) - duty * period / 2**bits).max() <= 1


@pytest.mark.parametrize(("reset", "continues"), [(1 << 5, True), (1 << 31, False)], ids=["processors", "all"])
def test_ledc_continues_through_a_reset_of_the_processors(kind: Chip, reset: int, continues: bool) -> None:
    """The wave of a charge pump keeps its relay closed, unless the program takes it off the pin."""
    with VirtualChip(kind) as chip:
        entry = {Chip.ESP32: 0x40080400, Chip.ESP32S3: 0x403C0400}[kind]
        app = images.image(entry, [(entry, c.jump(0) + b"\0")], chip=images.CHIP_IDS[kind])
        chip.load(images.merged(kind, app))
        regs = Registers(chip, kind)
        regs.store(regs.at.gpio + 0x24, 1 << PIN)
        route(regs, LEDC[kind].signal)
        ledc_timer(regs, kind, 256, 8)
        ledc_duty(regs, kind, 128 << 4)
        regs.wait(5000)
        regs.store({Chip.ESP32: 0x3FF48000, Chip.ESP32S3: 0x60008000}[kind], reset)
        regs.wait(2)
        assert chip.resets[0] == 1
        chip.edges()
        regs.wait(20 * 768)
        assert (len(levels(chip)) >= 38) == continues
        assert continues or chip.level(PIN) == 0


def test_ledc_duty_of_none_and_of_all(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        route(regs, LEDC[kind].signal)
        ledc_timer(regs, kind, 256, 6)
        ledc_duty(regs, kind, 0)
        regs.wait(2000)
        assert levels(chip) == [] and chip.level(PIN) == 0
        ledc_duty(regs, kind, 64 << 4)
        regs.wait(2000)
        assert [level for _, level in levels(chip)] == [1]


def test_ledc_sixteenths_of_a_count(kind: Chip) -> None:
    """DUTY's low four bits: of 16 periods so many have one count more."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        route(regs, LEDC[kind].signal)
        ledc_timer(regs, kind, 256, 5)
        ledc_duty(regs, kind, 10 << 4 | 5)
        regs.wait(3 * 32 * 40)
        _, highs = rises_and_highs(levels(chip))
        longer = [high > 31 for high in highs[4:36]]
        assert sum(longer) == 10 and {*highs[4:36]} == {30, 33}


def test_ledc_changes_at_the_end_of_a_period(kind: Chip) -> None:
    """A new duty makes no pulse of another length than the old or the new one."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        route(regs, LEDC[kind].signal)
        ledc_timer(regs, kind, 256, 8)
        ledc_duty(regs, kind, 100 << 4)
        regs.wait(768 * 3 + 77)
        chip.edges()
        ledc_duty(regs, kind, 30 << 4)
        regs.wait(768 * 5)
        periods, highs = rises_and_highs(levels(chip)[1:])
        assert set(periods) == {768} and highs == [90] * len(highs)


def test_ledc_idle_level_and_hpoint(kind: Chip) -> None:
    at = LEDC[kind]
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        route(regs, at.signal)
        regs.store(at.base + at.channels + 2 * 0x14, 1 << 3)
        assert chip.level(PIN) == 1
        ledc_timer(regs, kind, 256, 8)
        ledc_duty(regs, kind, 16 << 4, hpoint=200)
        regs.wait(768 * 4)
        periods, highs = rises_and_highs(levels(chip)[2:])
        assert set(periods) == {768} and set(highs) == {48}


def test_ledc_fade_is_refused(kind: Chip) -> None:
    at = LEDC[kind]
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        regs.store(at.base + at.channels + 12, 1 << 31 | 3)
        with pytest.raises(ChipFault, match="a fade of LEDC"):
            regs.store(at.base + at.channels, 1 << 4)


def test_ledc_costs_nothing_without_an_output(kind: Chip) -> None:
    """Its overflow is seen even so."""
    at = LEDC[kind]
    raw = at.conf - 0x10
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        ledc_timer(regs, kind, 256, 1)
        regs.wait(100_000)
        assert regs.load(at.base + raw) & 1 << (6 if kind == Chip.ESP32 else 2)


# ---- MCPWM ----

MCPWM = {Chip.ESP32: (0x3FF5E000, 32), Chip.ESP32S3: (0x6001E000, 160)}
T_CONFIG, T_MODE, COMPARE_METHODS, COMPARE, GENERATOR, RAW = 0x04, 0x08, 0x3C, 0x40, 0x50, 0x114
LOW_AT_LAST, HIGH_AT_A = 1 << 2, 2 << 4
RUN_UP, STOP_EMPTY = 2 | 1 << 3, 0 | 1 << 3


def mcpwm(regs: Registers, kind: Chip, group: int, prescale: int, counts: int, compare: int) -> None:
    """As hal/spindle_pwm.c sets it up: high from the comparison to the last count."""
    base, signal = MCPWM[kind]
    route(regs, signal)
    regs.store(base, group - 1)
    regs.store(base + T_CONFIG, (prescale - 1) | (counts - 1) << 8)
    regs.store(base + COMPARE_METHODS, 1)  # at zero
    regs.store(base + COMPARE, compare)
    regs.store(base + GENERATOR, LOW_AT_LAST | HIGH_AT_A)
    regs.store(base + T_MODE, RUN_UP)


@pytest.mark.parametrize(
    ("group", "prescale", "counts", "compare"), [(2, 1, 16000, 4000), (2, 3, 100, 98), (1, 1, 999, 1), (5, 255, 40, 0)]
)
def test_mcpwm_makes_its_formula(kind: Chip, group: int, prescale: int, counts: int, compare: int) -> None:
    """160 MHz / group / prescale, a period of `counts`; high from the comparison to the last count."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, group, prescale, counts, compare)
        count = group * prescale * 1.5
        regs.wait(round(count * counts * 12.5))
        edges = levels(chip)[1:] if compare == 0 else levels(chip)
        periods, highs = rises_and_highs(edges[2:])
        assert len(periods) >= 8
        assert np.abs(np.cumsum(periods) - counts * count * np.arange(1, len(periods) + 1)).max() <= 1
        assert np.abs(np.array(highs) - (counts - 1 - compare) * count).max() <= 1


def test_mcpwm_is_dark_after_its_own_reset(kind: Chip) -> None:
    """Which ESP-IDF's esp_restart_noos() gives it, a panic too, before it resets the processors."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, 2, 1, 1000, 500)
        regs.wait(12_000)
        assert len(levels(chip)) >= 6
        while chip.level(PIN) == 0:
            regs.wait(100)
        resets = {Chip.ESP32: 0x3FF000C4, Chip.ESP32S3: 0x600C0020}[kind]
        regs.store(resets, 1 << 17)
        assert regs.load(resets) == 1 << 17 and chip.level(PIN) == 0
        regs.store(resets, 0)
        chip.edges()
        regs.wait(12_000)
        assert levels(chip) == []
        mcpwm(regs, kind, 2, 1, 1000, 500)
        regs.wait(12_000)
        assert len(levels(chip)) >= 6


def test_mcpwm_is_dark_when_the_comparison_is_never_reached(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, 2, 1, 1000, 65535)
        regs.wait(30_000)
        assert levels(chip) == []


@pytest.mark.parametrize("wait", [1, 700, 1400, 2100, 2990])
def test_mcpwm_takes_a_comparison_at_zero(kind: Chip, wait: int) -> None:
    """A store at any moment makes no pulse of a third length."""
    base, _ = MCPWM[kind]
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, 2, 1, 1000, 400)
        regs.wait(6000 + wait)
        regs.store(base + COMPARE, 700)
        regs.wait(9000)
        _, highs = rises_and_highs(levels(chip))
        assert {*highs} == {3 * 599, 3 * 299} and highs == sorted(highs, reverse=True)


def test_mcpwm_stops_at_zero_and_takes_another_divider(kind: Chip) -> None:
    base, _ = MCPWM[kind]
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, 2, 1, 1000, 500)
        regs.wait(4000)
        regs.store(base + T_MODE, STOP_EMPTY)
        regs.wait(3000)
        assert regs.load(base + RAW) & 1
        chip.edges()
        regs.wait(20_000)
        assert levels(chip) == []
        regs.store(base + T_CONFIG, 3 | 199 << 8)
        regs.store(base + COMPARE, 100)
        regs.store(base + T_MODE, RUN_UP)
        regs.wait(20_000)
        periods, highs = rises_and_highs(levels(chip)[2:])
        assert set(periods) == {200 * 12} and set(highs) == {99 * 12}


@pytest.mark.parametrize(
    ("offset", "value", "words"),
    [(T_MODE, 2 | 3 << 3, "mode 3"), (0x0C, 1, "synchronisation"), (0x58, 0, "dead time"), (0x64, 1, "the carrier")],
)
def test_what_mcpwm_cannot_is_refused(kind: Chip, offset: int, value: int, words: str) -> None:
    base, _ = MCPWM[kind]
    with VirtualChip(kind) as chip, pytest.raises(ChipFault, match=words):
        Registers(chip, kind).store(base + offset, value)


# ---- RMT ----

RMT = {Chip.ESP32: (0x3FF56000, 87), Chip.ESP32S3: (0x60016000, 81)}
RMT_RAW = {Chip.ESP32: 0xA0, Chip.ESP32S3: 0x70}
WORDS = {Chip.ESP32: 64, Chip.ESP32S3: 48}


class Rmt:
    """Channel 1."""

    def __init__(self, regs: Registers, kind: Chip, divider: int, blocks: int = 1, wraps: bool = False) -> None:
        self.regs, self.kind, (self.base, signal) = regs, kind, RMT[kind]
        route(regs, signal + 1)
        if kind == Chip.ESP32:
            regs.store(self.base + 0xF0, 1 | wraps << 1)
            regs.store(self.base + 0x28, divider | blocks << 24)
            self.rest, self.at, self.rewind, self.take = 1 << 17 | 1 << 19, 0x2C, 1 << 3, 0
        else:
            self.rest, self.at, self.rewind = divider << 8 | blocks << 16 | 1 << 6 | wraps << 4, 0x24, 1 << 1
            self.take = 1 << 24
            regs.store(self.base + 0xC0, 1 << 24)  # 80 MHz, undivided
        regs.store(self.base + self.at, self.rest | self.rewind | self.take)

    def put(self, *halves: tuple[int, int], at: int = 0) -> None:
        """(level, ticks) of each half word; both halves of the last word."""
        values = [level << 15 | ticks for level, ticks in halves]
        values += [0] * (len(values) % 2)
        for word in range(len(values) // 2):
            place = self.base + 0x800 + 4 * (WORDS[self.kind] + at + word)
            self.regs.store(place, values[2 * word] | values[2 * word + 1] << 16)

    def start(self) -> None:
        self.regs.store(self.base + self.at, self.rest | self.rewind)
        self.regs.store(self.base + self.at, self.rest | 1)

    def raw(self) -> int:
        return self.regs.load(self.base + RMT_RAW[self.kind])


def lengths(edges: list[tuple[int, int]]) -> list[int]:
    return [int(cycles) for cycles in np.diff([cycle for cycle, _ in edges])]


def test_rmt_plays_levels_for_so_many_ticks(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        rmt = Rmt(regs, kind, divider=8)
        rmt.put((1, 10), (0, 20), (1, 30), (0, 1), (1, 2), (0, 40), (0, 0))
        rmt.start()
        regs.wait(5000)
        assert lengths(levels(chip)) == [24 * ticks for ticks in (10, 20, 30, 1, 2)]
        assert rmt.raw() & (1 << 3 if kind == Chip.ESP32 else 1 << 1)


def test_rmt_makes_a_pulse_at_each_start(kind: Chip) -> None:
    """As hal/pulse_rmt.h: a pulse lies ready, and each start plays it again."""
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        rmt = Rmt(regs, kind, divider=1)
        rmt.put((1, 160), (0, 16), (0, 0))
        for _ in range(5):
            rmt.start()
            regs.wait(1000)
        edges = levels(chip)
        assert [level for _, level in edges] == [1, 0] * 5
        assert lengths(edges)[::2] == [480] * 5


def test_rmt_wraps_and_says_when_half_has_gone(kind: Chip) -> None:
    """As ESP-IDF's driver sends more than its memory holds: the other half is filled meanwhile."""
    limit, many = (0xD4, 1 << 25) if kind == Chip.ESP32 else (0xA4, 1 << 9)
    half = WORDS[kind] // 2
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        rmt = Rmt(regs, kind, divider=1, wraps=True)
        regs.store(rmt.base + limit, half)
        rmt.put(*[(1, 4000), (0, 2000)] * half * 2)
        rmt.start()
        word_cycles = 3 * 6000
        regs.wait(word_cycles * half + 500)
        assert rmt.raw() & many
        rmt.put(*[(1, 3000), (0, 3000)] * half)
        regs.wait(word_cycles * half)
        rmt.put((1, 5), (0, 0), at=half)
        regs.wait(word_cycles * (half + 2))
        assert lengths(levels(chip))[::2] == [12000] * half * 2 + [9000] * half + [15]


def test_rmt_past_its_memory_is_named(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        rmt = Rmt(regs, kind, divider=1)
        rmt.put(*[(1, 1), (0, 1)] * WORDS[kind])
        rmt.start()
        with pytest.raises(ChipFault, match="RMT's channel 1 runs past the end"):
            regs.wait(1000)


def test_rmt_idle_level(kind: Chip) -> None:
    idle = {Chip.ESP32: 1 << 18, Chip.ESP32S3: 1 << 5}
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        rmt = Rmt(regs, kind, divider=1)
        regs.store(rmt.base + rmt.at, rmt.rest | idle[kind] | rmt.take)
        assert chip.level(PIN) == 1


def test_the_matrix_inverts_a_peripherals_signal(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        regs = Registers(chip, kind)
        mcpwm(regs, kind, 2, 1, 1000, 65535)
        route(regs, MCPWM[kind][1], inverted=True)
        assert chip.level(PIN) == 1
