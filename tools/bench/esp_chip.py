"""How fast the virtual ESP32 is: `make bench-chip`."""

from __future__ import annotations

import sys
import time

from wificnc_chips.esp32 import Chip, Cpu, VirtualChip

from bench import esp_steps
from bench.__main__ import show
from bench.measure import Figure

METHOD = """
Processor time of es_run(), best of three, of a program in the virtual ESP32's instruction RAM, for ever: eight
instructions that add, mask and jump; the same with a load and a store; and a call of a function with a window of its
own, which adds and returns."""

PLACES = {Chip.ESP32: 0x40080400, Chip.ESP32S3: 0x40378400}
DATA = {Chip.ESP32: 0x3FFB0000, Chip.ESP32S3: 0x3FC90000}
# add, or, addi, sub, and, xor, addi, j
ARITHMETIC = bytes.fromhex("302280 503420 22c201 2043c0 305410 406330 72c703 c6f9ff")
# l32i a3, a2, 0; addi; s32i a3, a2, 4; add; xor; addi; and; j
MEMORY = bytes.fromhex("322200 32c301 326201 405580 305330 72c701 306610 c6f9ff")
# call8 to the function, j back; entry a1, 32; add; retw
CALLS = bytes.fromhex("650000 46feff 0000 364100 302280 900000")
WINDOW_CHECKED = 0x40000  # PS.WOE
SECONDS = 0.5  # of the chip's time


def rate(program: bytes, kind: Chip) -> float:
    """Million instructions a second."""
    with VirtualChip(kind) as chip:
        chip.write(PLACES[kind], program)
        cpu = Cpu(pc=PLACES[kind], ps=WINDOW_CHECKED, windowstart=1)
        cpu.a[1], cpu.a[2] = DATA[kind] + 0x4000, DATA[kind]
        chip.set_cpu(cpu)
        best = 0.0
        for _ in range(3):
            before, begin = chip.instructions, time.process_time()
            chip.run(round(SECONDS * 240e6))
            best = max(best, (chip.instructions - before) / (time.process_time() - begin) / 1e6)
        return best


def main() -> int:
    print(METHOD)
    figures = [Figure("a loop", rate(ARITHMETIC, Chip.ESP32), "M instructions/s", 100, at_least=True)]
    figures += [Figure("the same on the S3", rate(ARITHMETIC, Chip.ESP32S3), "M instructions/s", 100, at_least=True)]
    figures += [Figure("with memory", rate(MEMORY, Chip.ESP32), "M instructions/s")]
    figures += [Figure("calls", rate(CALLS, Chip.ESP32), "M instructions/s")]
    show(figures)
    esp_steps.main()
    return 0 if all(figure.is_met for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
