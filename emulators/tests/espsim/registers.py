"""Stores to and loads from registers of the virtual ESP32, by a program of one instruction."""

from __future__ import annotations

from dataclasses import dataclass

from wificnc_chips.esp32.chip import Chip, Cpu, VirtualChip
from xtensa_programs import code as c


@dataclass(frozen=True)
class Places:
    """Of a chip's registers."""

    code: int
    vectors: int
    gpio: int
    timers: int
    interrupts: int  # in a timer group: ENA, RAW, ST, CLR
    matrix: int
    source: int  # of timer 0 of group 0
    outputs: int  # FUNC0_OUT_SEL_CFG
    pins: int  # GPIO_PIN0, and its bit of core 0's interrupt
    core0: int
    asking: int  # PCPU_INT of bank 0
    bank1_behind: int
    gpio_source: int
    uart: int
    uart_source: int
    thresholds: int  # CONF1: receiver full at 3, transmitter empty at 1, timeout on
    timeout: int  # register, and value for 16 bits
    timeout_value: int


PLACES = {
    Chip.ESP32: Places(
        code=0x40090000,
        vectors=0x40080000,
        gpio=0x3FF44000,
        timers=0x3FF5F000,
        interrupts=0x98,
        matrix=0x3FF00104,
        source=14,
        outputs=0x530,
        pins=0x88,
        core0=1 << 15,
        asking=0x68,
        bank1_behind=0x14,
        gpio_source=22,
        uart=0x3FF40000,
        uart_source=34,
        thresholds=3 | 1 << 8 | 2 << 24 | 1 << 31,
        timeout=0x24,
        timeout_value=0,
    ),
    Chip.ESP32S3: Places(
        code=0x40380000,
        vectors=0x40378000,
        gpio=0x60004000,
        timers=0x6001F000,
        interrupts=0x70,
        matrix=0x600C2000,
        source=50,
        outputs=0x554,
        pins=0x74,
        core0=1 << 13,
        asking=0x5C,
        bank1_behind=0x0C,
        gpio_source=16,
        uart=0x60000000,
        uart_source=27,
        thresholds=3 | 1 << 10 | 1 << 23,
        timeout=0x60,
        timeout_value=16 << 17,
    ),
}


class Registers:
    """Stores and loads by a program of one instruction, as the processor does them."""

    def __init__(self, chip: VirtualChip, kind: Chip) -> None:
        self.chip, self.at = chip, PLACES[kind]

    def _step(self, code: bytes, address: int, value: int = 0) -> Cpu:
        self.chip.write(self.at.code, code)
        cpu = Cpu(pc=self.at.code, ps=15, vecbase=self.at.vectors, windowstart=1)
        cpu.a[2], cpu.a[3] = address, value
        self.chip.set_cpu(cpu)
        self.chip.run(1)
        return self.chip.cpu()

    def store(self, address: int, value: int) -> None:
        self._step(c.s32i(3, 2, 0), address, value)

    def load(self, address: int) -> int:
        return int(self._step(c.l32i(3, 2, 0), address).a[3])

    def wait(self, cycles: int) -> None:
        """With interrupts held off."""
        loop = c.jump(0)
        self.chip.write(self.at.code, loop)
        self.chip.set_cpu(Cpu(pc=self.at.code, ps=15, vecbase=self.at.vectors, windowstart=1))
        self.chip.run(cycles)
