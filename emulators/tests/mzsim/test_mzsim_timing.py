"""What time costs in the virtual chip when it is asked for: instructions, caches, registers."""

from __future__ import annotations

import struct

import pytest
from wificnc.build.image import Block
from wificnc_chips.pic32mz.chip import Cpu, Timing, VirtualChip

FLASH, RAM = 0x9D000000, 0x80001000
NOP, BACK = 0x00000000, 0x1000FFFF
LW = 0x8C000000  # lw zero, 0(zero); with rs << 21 | rt << 16 | offset


def chip_with(timing: Timing, code: list[int]) -> VirtualChip:
    """The code in flash, its first line at FLASH."""
    chip = VirtualChip([Block(0x1D000000, struct.pack(f"<{len(code)}I", *code))])
    chip.timing(timing)
    cpu = Cpu(pc=FLASH, next_pc=FLASH + 4)
    cpu.r[8], cpu.r[9], cpu.r[10] = 0x80010000, 0xA0010000, 0xBF840610  # RAM, RAM uncached, TMR4
    chip.set_cpu(cpu)
    return chip


def cost(timing: Timing, code: list[int]) -> list[float]:
    """Cycles of the CPU that each instruction takes."""
    with chip_with(timing, [*code, BACK, NOP]) as chip:
        taken = []
        for _ in code:
            begin = chip.cycles
            chip.step()
            taken.append((chip.cycles - begin) / 4)
        return taken


@pytest.mark.parametrize("cycles", [1.0, 1.5, 2.0])
def test_every_instruction_takes_so_many_cycles(cycles: float) -> None:
    assert cost(Timing(instruction=cycles), [NOP] * 6) == [cycles] * 6


def test_a_line_of_code_is_fetched_once() -> None:
    """16 bytes: four instructions; the next line has been prefetched."""
    timing = Timing(instruction=1, fetch_miss=12, fetch_next=4)
    assert cost(timing, [NOP] * 9) == [13, 1, 1, 1, 5, 1, 1, 1, 5]


def test_a_line_of_data_is_fetched_once_and_past_the_cache_always() -> None:
    timing = Timing(instruction=1, data_miss=12, uncached=20)
    cached, past = LW | 8 << 21, LW | 9 << 21
    assert cost(timing, [cached, cached + 4, cached + 16, past, past]) == [13, 1, 13, 21, 21]


def test_a_fifth_line_of_a_set_evicts_the_oldest() -> None:
    """64 sets of four: lines 1 KB apart share a set."""
    load = LW | 8 << 21
    code = [load + 1024 * n for n in (0, 1, 2, 3, 0, 4, 1, 0)]
    assert cost(Timing(instruction=1, data_miss=12), code) == [13, 13, 13, 13, 1, 13, 13, 1]


def test_a_register_costs_its_bus() -> None:
    assert cost(Timing(instruction=1, sfr_load=20), [LW | 10 << 21, NOP]) == [21, 1]
