"""Registers as the step engine uses them. Technical reference manuals, chapters IO MUX and GPIO Matrix, Timer Group."""

from __future__ import annotations

import pytest
from registers import PLACES, Registers
from wificnc_chips.esp32.chip import Chip, Cpu, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

TICK = 6  # cycles: 80 MHz / 2
RUN, UP, LEVEL, ALARM, DIVIDE_BY_2 = 1 << 31, 1 << 30, 1 << 11, 1 << 10, 2 << 13


@pytest.fixture
def registers(chip: VirtualChip, request: pytest.FixtureRequest) -> Registers:
    return Registers(chip, request.node.callspec.params["chip"])


def test_pins(registers: Registers) -> None:
    """Set and clear registers, both banks; each edge with its cycle."""
    gpio, chip = registers.at.gpio, registers.chip
    registers.store(gpio + 0x24, 1 << 4 | 1 << 5)  # ENABLE_W1TS
    registers.store(gpio + 0x30, 1 << 1)
    chip.record_edges()
    begin = chip.cycles
    registers.store(gpio + 0x08, 1 << 4 | 1 << 9)  # OUT_W1TS; pin 9 is no output
    registers.store(gpio + 0x14, 1 << 1)
    registers.store(gpio + 0x0C, 1 << 4)
    assert chip.edges() == [(begin + 1, 4, 1), (begin + 2, 33, 1), (begin + 3, 4, 0)]
    assert registers.load(gpio + 0x04) == 1 << 9
    assert (chip.level(4), chip.level(33)) == (0, 1)


def test_inputs(registers: Registers) -> None:
    registers.chip.drive(34, 1)
    registers.chip.drive(3, 1)
    assert registers.load(registers.at.gpio + 0x40) == 1 << 2
    assert registers.load(registers.at.gpio + 0x3C) == 1 << 3
    registers.chip.drive(3, -1)
    assert registers.load(registers.at.gpio + 0x3C) == 0


IO_MUX_4 = {Chip.ESP32: 0x3FF49048, Chip.ESP32S3: 0x60009014}  # the register of GPIO 4
IO_MUX_5 = {Chip.ESP32: 0x3FF4906C, Chip.ESP32S3: 0x60009018}
RTC_IO_4 = 0x3FF48494


def test_pull_ups(registers: Registers) -> None:
    """By IO_MUX; those of the ESP32's RTC pins, as GPIO 4, by RTC_IO. What drives a pin is stronger."""
    kind = Chip.ESP32 if registers.at is PLACES[Chip.ESP32] else Chip.ESP32S3
    registers.store(IO_MUX_5[kind], 1 << 8)
    if kind == Chip.ESP32:
        registers.store(RTC_IO_4, 1 << 27)
    else:
        registers.store(IO_MUX_4[kind], 1 << 8)
    for pin in (4, 5):
        assert registers.chip.level(pin) == 1
        registers.chip.drive(pin, 0)
        assert registers.chip.level(pin) == 0
        registers.chip.drive(pin, -1)
    registers.store(IO_MUX_5[kind], 0)
    assert registers.chip.level(5) == 0


def test_the_matrix_inverts(registers: Registers) -> None:
    registers.store(registers.at.gpio + 0x24, 1 << 4)
    registers.store(registers.at.gpio + registers.at.outputs + 4 * 4, 256 | 1 << 9)
    assert registers.chip.level(4) == 1


def test_signals_of_other_peripherals_stop_the_chip(registers: Registers) -> None:
    with pytest.raises(ChipFault, match="GPIO 4 is routed to the signal 96, which is not emulated"):
        registers.store(registers.at.gpio + registers.at.outputs + 4 * 4, 96)


# ---- interrupts of pins ----

RISING, FALLING, EDGES, LOW, HIGH = 1, 2, 3, 4, 5


def watch(registers: Registers, pin: int, kind: int) -> None:
    at = registers.at
    registers.store(at.matrix + 4 * at.gpio_source, 19)
    registers.store(at.gpio + at.pins + 4 * pin, kind << 7 | at.core0)


def asks(registers: Registers) -> bool:
    return bool(registers.chip.cpu().interrupt == 1 << 19)


@pytest.mark.parametrize(("kind", "edges"), [(RISING, [1]), (FALLING, [0]), (EDGES, [1, 0]), (0, [])])
@pytest.mark.parametrize("pin", [4, 34])
def test_edges_of_inputs_interrupt(registers: Registers, kind: int, edges: list[int], pin: int) -> None:
    """Once each: until STATUS is cleared."""
    at, chip, bank = registers.at, registers.chip, pin // 32
    watch(registers, pin, kind)
    for level in (1, 0):
        chip.drive(pin, level)
        registers.wait(2)
        assert asks(registers) == (level in edges)
        assert registers.load(at.gpio + at.asking + bank * at.bank1_behind) == (level in edges) << pin % 32
        registers.store(at.gpio + 0x4C + 12 * bank, 1 << pin % 32)
        registers.wait(2)
        assert not asks(registers)


def test_pins_interrupt_core_1_of_the_esp32(esp32: VirtualChip) -> None:
    """By INT_ENA's bit 13, and its own matrix."""
    registers = Registers(esp32, Chip.ESP32)
    registers.store(0x3FF00218 + 4 * registers.at.gpio_source, 19)
    registers.store(registers.at.gpio + registers.at.pins + 4 * 4, RISING << 7 | 1 << 13)
    esp32.drive(4, 1)
    registers.wait(2)
    assert (esp32.cpu(0).interrupt, esp32.cpu(1).interrupt) == (0, 1 << 19)
    assert registers.load(registers.at.gpio + 0x60) == 1 << 4
    assert registers.load(registers.at.gpio + registers.at.asking) == 0


def test_levels_of_inputs_interrupt_again(registers: Registers) -> None:
    registers.chip.drive(4, 1)
    watch(registers, 4, HIGH)
    registers.store(registers.at.gpio + 0x4C, 1 << 4)
    registers.wait(2)
    assert asks(registers)
    registers.chip.drive(4, 0)
    registers.store(registers.at.gpio + 0x4C, 1 << 4)
    registers.wait(2)
    assert not asks(registers)


def count(registers: Registers) -> int:
    registers.store(registers.at.timers + 0x0C, 1)
    return registers.load(registers.at.timers + 0x04)


def start(registers: Registers, alarm: int, flags: int = ALARM | LEVEL) -> None:
    timer = registers.at.timers
    registers.store(timer + registers.at.interrupts, 1)
    registers.store(timer + 0x18, 0)
    registers.store(timer + 0x1C, 0)
    registers.store(timer + 0x20, 1)
    registers.store(timer + 0x10, alarm)
    registers.store(timer + 0x14, 0)
    registers.store(timer + 0x00, RUN | UP | DIVIDE_BY_2 | flags)


def is_raw(registers: Registers) -> bool:
    return bool(registers.load(registers.at.timers + registers.at.interrupts + 4) & 1)


def test_a_timer_counts(registers: Registers) -> None:
    start(registers, 0, 0)
    began = registers.chip.cycles
    registers.wait(1000)
    assert count(registers) == (registers.chip.cycles - 1 - began) // TICK
    registers.store(registers.at.timers, UP | DIVIDE_BY_2)
    stopped = count(registers)
    registers.wait(100)
    assert count(registers) == stopped


def test_an_alarm_comes_once(registers: Registers) -> None:
    start(registers, 50)
    registers.wait(50 * TICK - 5)
    assert not is_raw(registers)
    registers.wait(5)
    assert is_raw(registers)
    registers.store(registers.at.timers + registers.at.interrupts + 12, 1)  # INT_CLR
    registers.wait(1000)
    assert not is_raw(registers)
    assert registers.load(registers.at.timers) & ALARM == 0


def test_an_alarm_that_has_passed_comes_immediately(registers: Registers) -> None:
    start(registers, 0, 0)
    registers.wait(1000)
    registers.store(registers.at.timers + 0x10, 3)
    registers.store(registers.at.timers, RUN | UP | DIVIDE_BY_2 | ALARM | LEVEL)
    assert is_raw(registers)


def test_an_alarm_interrupts_at_its_cycle(registers: Registers) -> None:
    """Through the matrix to an interrupt of level 5, above what PS.EXCM holds off."""
    chip, at = registers.chip, registers.at
    registers.store(at.matrix + 4 * at.source, 26)
    start(registers, 100)
    began = chip.cycles
    chip.write(at.vectors + 0x240, c.rsr(4, c.CCOUNT) + c.jump(0))
    chip.write(at.code, c.jump(0))
    chip.set_cpu(Cpu(pc=at.code, ps=0x10, vecbase=at.vectors, windowstart=1, intenable=1 << 26))
    chip.run(1000)
    assert chip.cpu().a[4] == began + 100 * TICK + 1


def test_a_source_without_a_route_goes_nowhere(registers: Registers) -> None:
    start(registers, 10)
    registers.wait(200)
    assert is_raw(registers) and registers.chip.cpu().interrupt == 0


def test_level_interrupts_of_the_esp32_need_their_bit(esp32: VirtualChip) -> None:
    registers = Registers(esp32, Chip.ESP32)
    start(registers, 10, ALARM)
    registers.wait(200)
    assert not is_raw(registers)


def test_registers_that_are_not_emulated_stop_the_chip(registers: Registers) -> None:
    with pytest.raises(ChipFault, match="the GPIO register 000 is not emulated"):
        registers.store(registers.at.gpio, 1)
    with pytest.raises(ChipFault):
        registers.load(registers.at.gpio + 0x63C)


# ---- UART 0 ----

DIVIDER = 40  # 2 MBd: a bit is 120 cycles
BIT = 3 * DIVIDER
BYTE = 10 * BIT
RX_FULL, TX_EMPTY, RX_OVERFLOW, RX_TIMEOUT, TX_DONE = 1, 2, 1 << 4, 1 << 8, 1 << 14


def set_up_uart(registers: Registers) -> int:
    uart = registers.at.uart
    registers.store(uart + 0x14, DIVIDER)
    registers.store(uart + 0x24, registers.at.thresholds)
    if registers.at.timeout != 0x24:
        registers.store(uart + registers.at.timeout, registers.at.timeout_value)
    return uart


def test_bytes_go_out_one_after_the_other(registers: Registers) -> None:
    uart, chip = set_up_uart(registers), registers.chip
    begin = chip.cycles + 1
    for byte in b"abc":
        registers.store(uart, byte)
    registers.store(uart + 0x10, TX_EMPTY)
    registers.wait(begin + BYTE - 1 - chip.cycles)
    assert chip.read_serial() == b""
    registers.wait(1)
    assert chip.read_serial() == b"a"
    assert registers.load(uart + 0x1C) >> 16 == 2
    assert not registers.load(uart + 0x04) & (TX_EMPTY | TX_DONE)
    registers.wait(begin + 3 * BYTE - chip.cycles)
    assert chip.read_serial() == b"bc"
    assert registers.load(uart + 0x04) & (TX_EMPTY | TX_DONE) == TX_EMPTY | TX_DONE


def test_bytes_come_in_at_their_speed(registers: Registers) -> None:
    uart, chip = set_up_uart(registers), registers.chip
    chip.write_serial(b"wxyz")
    registers.wait(2 * BYTE)
    assert registers.load(uart + 0x1C) == 2 and not registers.load(uart + 0x04) & RX_FULL
    registers.wait(BYTE)
    assert registers.load(uart + 0x04) & RX_FULL
    registers.wait(BYTE)
    assert bytes(registers.load(uart) for _ in range(4)) == b"wxyz"


def test_a_timeout_tells_of_few_bytes(registers: Registers) -> None:
    """16 bits after the last byte."""
    uart, chip = set_up_uart(registers), registers.chip
    chip.write_serial(b"?")
    registers.wait(BYTE + 15 * BIT)
    assert not registers.load(uart + 0x04) & RX_TIMEOUT
    registers.wait(BIT)
    assert registers.load(uart + 0x04) & RX_TIMEOUT


def test_a_full_receiver_loses_bytes_and_says_so(registers: Registers) -> None:
    uart, chip = set_up_uart(registers), registers.chip
    chip.write_serial(bytes(range(130)))
    registers.wait(131 * BYTE)
    assert registers.load(uart + 0x1C) == 128
    assert registers.load(uart + 0x04) & RX_OVERFLOW
    assert [registers.load(uart) for _ in range(128)] == list(range(128))


def test_the_uart_interrupts(registers: Registers) -> None:
    uart, at = set_up_uart(registers), registers.at
    registers.store(at.matrix + 4 * at.uart_source, 5)
    registers.store(uart + 0x0C, RX_FULL)
    registers.chip.write_serial(b"123")
    registers.wait(3 * BYTE + 2)
    assert registers.chip.cpu().interrupt == 1 << 5
    for _ in range(3):
        registers.load(uart)
    registers.store(uart + 0x10, RX_FULL)
    assert registers.chip.cpu().interrupt == 0


@pytest.mark.parametrize(("write", "count", "says"), [(True, 129, "its FIFO is full"), (False, 1, "its FIFO is empty")])
def test_what_a_chip_would_lose_in_silence(registers: Registers, write: bool, count: int, says: str) -> None:
    uart = registers.at.uart
    with pytest.raises(ChipFault, match=says):
        for _ in range(count):
            registers.store(uart, 0) if write else registers.load(uart)
