"""Pulse counters, the ESP32's I2S and shift registers behind it. Technical reference manuals, chapters Pulse Count
Controller and I2S Controller; data sheet of the 74HC595."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import pytest
from registers import Registers
from wificnc_chips.esp32.chip import SHIFT_FIRST, Chip, VirtualChip
from wificnc_chips.fault import ChipFault

A, B = 4, 5
FORWARD = ((1, 0), (1, 1), (0, 1), (0, 0))  # levels of A and B


@dataclass(frozen=True)
class Pcnt:
    base: int
    count: int  # of unit 0
    raw: int
    status: int
    control: int
    signal: int


PCNT = {
    Chip.ESP32: Pcnt(0x3FF57000, 0x60, 0x80, 0x90, 0xB0, 39),
    Chip.ESP32S3: Pcnt(0x60017000, 0x30, 0x40, 0x50, 0x60, 33),
}
INPUTS = {Chip.ESP32: 0x130, Chip.ESP32S3: 0x154}
UP, DOWN, INVERT = 1, 2, 1


@pytest.fixture(params=list(Chip), ids=["esp32", "esp32s3"])
def kind(request: pytest.FixtureRequest) -> Chip:
    return Chip(request.param)


class Counter:
    """Unit 0 as io/encoder.c sets it up: four counts a line of a quadrature encoder."""

    def __init__(self, chip: VirtualChip, kind: Chip, filter_apb: int = 0, limit: int = 1000) -> None:
        self.chip, self.regs, self.at = chip, Registers(chip, kind), PCNT[kind]
        for pin in (A, B):
            chip.drive(pin, 0)
        for offset, pin in ((0, A), (1, B), (2, B), (3, A)):  # edges of channels 0, 1; levels of channels 0, 1
            self.regs.store(self.regs.at.gpio + INPUTS[kind] + 4 * (self.at.signal + offset), pin | 1 << 7)
        channel0 = UP << 0 | DOWN << 2 | INVERT << 6  # falling, rising; kept at high, inverted at low
        channel1 = DOWN << 0 | UP << 2 | INVERT << 6
        filters = filter_apb | (filter_apb != 0) << 10
        self.regs.store(self.at.base, filters | 3 << 12 | channel0 << 16 | channel1 << 24)
        self.regs.store(self.at.base + 8, limit | (-limit & 0xFFFF) << 16)
        self.regs.store(self.at.base + self.at.control, 0)

    def turn(self, steps: int, wait: int = 20) -> None:
        order = FORWARD if steps > 0 else ((0, 1), (1, 1), (1, 0), (0, 0))
        for step in range(abs(steps)):
            self.chip.drive(A, order[step % 4][0])
            self.chip.drive(B, order[step % 4][1])
            self.regs.wait(wait)

    def count(self) -> int:
        value = self.regs.load(self.at.base + self.at.count)
        return value - 65536 if value >= 32768 else value


@pytest.mark.parametrize("steps", [4, -4, 100, -100])
def test_quadrature_counts_each_edge(kind: Chip, steps: int) -> None:
    with VirtualChip(kind) as chip:
        counter = Counter(chip, kind)
        counter.turn(steps)
        assert counter.count() == steps
        counter.turn(-steps)
        assert counter.count() == 0


def test_at_a_limit_the_count_is_zero_and_an_event_is_there(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        counter = Counter(chip, kind, limit=12)
        counter.turn(16)
        assert counter.count() == 4
        assert counter.regs.load(counter.at.base + counter.at.raw) == 1
        assert counter.regs.load(counter.at.base + counter.at.status) & 1 << 5  # the high limit
        counter.regs.store(counter.at.base + counter.at.raw + 12, 1)
        assert counter.regs.load(counter.at.base + counter.at.raw) == 0
        counter.turn(-16)
        assert counter.count() == 0  # 4 down to -12, which is the low limit
        assert counter.regs.load(counter.at.base + counter.at.status) & 1 << 4


@pytest.mark.parametrize(("width", "counts"), [(290, 0), (310, 2)])
def test_the_filter_drops_what_is_shorter(kind: Chip, width: int, counts: int) -> None:
    """100 cycles of 80 MHz: 300 of the processor's."""
    with VirtualChip(kind) as chip:
        counter = Counter(chip, kind, filter_apb=100)
        at = counter.at.base
        counter.regs.store(at, 100 | 1 << 10 | UP << 16 | UP << 18)  # both edges of A, whatever B is
        counter.regs.wait(1000)
        for _ in range(3):
            chip.drive(A, 1)
            counter.regs.wait(width)
            chip.drive(A, 0)
            counter.regs.wait(1000)
        assert counter.count() == 3 * counts


def test_a_held_counter_and_a_reset_one(kind: Chip) -> None:
    with VirtualChip(kind) as chip:
        counter = Counter(chip, kind)
        counter.turn(8)
        counted = counter.count()
        counter.regs.store(counter.at.base + counter.at.control, 1 << 1)  # pause
        counter.turn(8)
        assert counter.count() == counted
        counter.regs.store(counter.at.base + counter.at.control, 1 << 0)  # reset
        assert counter.count() == 0


# ---- I2S and shift registers ----

I2S = 0x3FF4F000
CLOCK, DATA, LATCH = 22, 21, 17
FRAME = 480  # 32 bits of 160 MHz / 5 / 2
SIGNALS = {CLOCK: 23, DATA: 163, LATCH: 25}
CONF, RAW, CLEAR, FIFO_CONF, CONF1, DIVIDER, RATE = 0x08, 0x0C, 0x18, 0x20, 0xA0, 0xAC, 0xB0
FORMAT, START = 1 << 8 | 1 << 16, 1 << 4


class Transmitter:
    """As hal/shift_i2s.c sets it up."""

    def __init__(self, chip: VirtualChip, divider: int = 5, bit_divider: int = 2) -> None:
        self.chip, self.regs = chip, Registers(chip, Chip.ESP32)
        chip.wire_shift_registers(CLOCK, DATA, LATCH)
        for offset, value in (
            (CONF, FORMAT),
            (CONF1, 1 << 3),
            (FIFO_CONF, 1 << 19),
            (DIVIDER, divider | 1 << 20),
            (RATE, bit_divider | 16 << 12),
        ):
            self.regs.store(I2S + offset, value)

    def put(self, *words: int) -> None:
        for word in words:
            self.regs.store(I2S, word)

    def start(self) -> None:
        self.regs.store(I2S + CONF, FORMAT | START)

    def route(self, pin: int) -> None:
        self.regs.store(self.regs.at.gpio + self.regs.at.outputs + 4 * pin, SIGNALS[pin])

    def shown(self) -> list[tuple[int, int]]:
        """(cycle, outputs) of each change since power-on."""
        outputs, found = 0xFFFFFFFF, dict[int, int]()
        for cycle, pin, level in self.chip.edges():
            if pin >= SHIFT_FIRST:
                bit = 1 << (pin - SHIFT_FIRST)
                outputs = outputs | bit if level else outputs & ~bit
                found[cycle] = outputs
        return list(found.items())


@pytest.mark.parametrize(("divider", "bit_divider"), [(5, 2), (4, 3), (2, 2)])
def test_words_leave_one_each_frame(esp32: VirtualChip, divider: int, bit_divider: int) -> None:
    """A word is shown when all of it has been shifted: the frame after. 32 bits of 160 MHz, divided twice."""
    sent = Transmitter(esp32, divider, bit_divider)
    esp32.record_edges()
    words = [0x12345678, 0x80000001, 0xFFFFFFFF, 0, 0xA5A5A5A5]
    sent.put(0x0F0F0F0F, *words)
    sent.start()
    for pin in (CLOCK, DATA, LATCH):
        sent.route(pin)
    sent.regs.wait(10 * FRAME)
    shown = sent.shown()
    frame = 32 * divider * bit_divider * 3 // 2
    assert [word for _, word in shown][-len(words) :] == words
    cycles = [cycle for cycle, _ in shown][-len(words) :]
    assert [later - cycle for cycle, later in pairwise(cycles)] == [frame] * (len(words) - 1)


def test_the_last_word_is_repeated_and_none_is_seen_twice(esp32: VirtualChip) -> None:
    sent = Transmitter(esp32)
    esp32.record_edges()
    sent.put(1, 1, 1)
    sent.start()
    for pin in (CLOCK, DATA, LATCH):
        sent.route(pin)
    sent.regs.wait(2_000_000)
    before = esp32.cycles
    sent.put(3)
    sent.regs.wait(3 * FRAME)
    (cycle, word) = sent.shown()[-1]
    assert word == 3 and FRAME <= cycle - before <= 2 * FRAME + 3
    sent.regs.wait(2_000_000)
    assert sent.shown() == [] and esp32.shift_outputs() == 3


def test_a_full_fifo_says_so_and_drops(esp32: VirtualChip) -> None:
    sent = Transmitter(esp32)
    sent.put(*range(64))
    assert sent.regs.load(I2S + RAW) & 1 << 4 == 0
    sent.put(0xDEAD)
    assert sent.regs.load(I2S + RAW) & 1 << 4
    sent.regs.store(I2S + CLEAR, 1 << 4)
    for pin in (CLOCK, DATA, LATCH):
        sent.route(pin)
    sent.start()
    sent.regs.wait(100 * FRAME)
    assert sent.regs.load(I2S + RAW) & 1 << 4 == 0 and esp32.shift_outputs() == 63


def test_a_reset_of_i2s_leaves_the_outputs(esp32: VirtualChip) -> None:
    """Which ESP-IDF's esp_restart_noos() gives it: what waits is gone, the registers show their last whole word."""
    sent = Transmitter(esp32)
    sent.put(5, 5, 5)
    sent.start()
    for pin in (CLOCK, DATA, LATCH):
        sent.route(pin)
    sent.regs.wait(6 * FRAME + FRAME // 3)
    sent.put(0xFFFFFFFF)
    sent.regs.store(0x3FF000C4, 1 << 4)
    sent.regs.store(0x3FF000C4, 0)
    sent.regs.wait(10 * FRAME)
    assert esp32.shift_outputs() == 5 and sent.regs.load(I2S + FIFO_CONF) & 1 << 12


def test_a_latch_in_the_middle_of_a_word_shows_its_bits(esp32: VirtualChip) -> None:
    """Sixteen ones, then zeros: half a frame after the clock was connected the chain has the first half alone."""
    sent = Transmitter(esp32)
    sent.put(*[0xFFFF0000] * 8)
    sent.route(CLOCK)
    sent.route(DATA)
    esp32.drive(LATCH, 0)
    sent.start()
    sent.regs.wait(FRAME // 2 - 2)
    esp32.drive(LATCH, 1)
    assert sent.regs.load(I2S + RAW) >= 0  # what has left until now is in the registers
    esp32.drive(LATCH, 0)
    esp32.drive(LATCH, 1)
    assert esp32.shift_outputs() & 0xFFFF == 0xFFFF


def test_shift_registers_by_hand(esp32: VirtualChip) -> None:
    """As step_shift_out() does before the peripheral is there: the first bit goes farthest."""
    regs = Registers(esp32, Chip.ESP32)
    esp32.wire_shift_registers(CLOCK, DATA, LATCH)
    assert esp32.shift_outputs() == 0xFFFFFFFF
    regs.store(regs.at.gpio + 0x24, 1 << CLOCK | 1 << DATA | 1 << LATCH)
    word = 0x8001C0DE
    for bit in range(31, -1, -1):
        regs.store(regs.at.gpio + (0x08 if word >> bit & 1 else 0x0C), 1 << DATA)
        regs.store(regs.at.gpio + 0x08, 1 << CLOCK)
        regs.store(regs.at.gpio + 0x0C, 1 << CLOCK)
    assert esp32.shift_outputs() == 0xFFFFFFFF
    regs.store(regs.at.gpio + 0x08, 1 << LATCH)
    assert esp32.shift_outputs() == word


@pytest.mark.parametrize(
    ("offset", "value", "words"), [(CONF, 1 << 4 | 1 << 10, "I2S0 with CONF"), (0x30, 1 << 29, "DMA of I2S0")]
)
def test_another_use_of_i2s_is_named(esp32: VirtualChip, offset: int, value: int, words: str) -> None:
    with pytest.raises(ChipFault, match=words):
        Registers(esp32, Chip.ESP32).store(I2S + offset, value)
