"""The virtual CPU against what an independent emulator made of the same instructions, and its exceptions by hand."""

from __future__ import annotations

import struct

import pytest
import vectors as v
from wificnc_chips.pic32mz.chip import Cpu, Stop, VirtualChip


def load(chip: VirtualChip, state: v.State, code: int) -> None:
    chip.write_ram(v.CODE & 0x1FFFFFFF, struct.pack("<3I", code, v.SLOT, v.SLOT))
    chip.write_ram(v.WINDOW & 0x1FFFFFFF, state.window)
    cpu = Cpu(hi=state.hi, lo=state.lo, pc=v.CODE, next_pc=v.CODE + 4, fcsr=state.fcsr)
    cpu.r[:] = state.r
    cpu.f[:] = state.f
    chip.set_cpu(cpu)


def save(chip: VirtualChip) -> tuple[v.State, int]:
    cpu = chip.cpu()
    window = chip.read_ram(v.WINDOW & 0x1FFFFFFF, v.WINDOW_SIZE)
    return v.State(list(cpu.r), list(cpu.f), cpu.hi, cpu.lo, cpu.fcsr & v.CONDITIONS, window), cpu.pc


def replay(chip: VirtualChip, vector: v.Vector) -> dict[int, int]:
    before = v.state(vector.number)
    load(chip, before, vector.word)
    for _ in range(2):
        if save(chip)[1] == v.CODE + 8:
            break  # a likely branch that was not taken: its slot is passed over
        assert chip.step() == Stop.TIME, chip.fault
    after, pc = save(chip)
    return v.changes(before, after, pc)


def test_every_vector(chip: VirtualChip) -> None:
    """Thousands of random instructions of every kind that compilers make, branches with their slots among them."""
    count, wrong = 0, []
    for vector in v.read():
        count += 1
        made = replay(chip, vector)
        if made != vector.changes:
            wrong.append((vector.number, f"{vector.word:08x}", made, vector.changes))
    assert count > 5000 and not wrong[:5], f"{len(wrong)} of {count}"


def test_the_generator_still_makes_the_words_of_the_file() -> None:
    assert all(v.instruction(vector.number) == vector.word for vector in v.read())


# ---- by hand: what happens between instructions ----

EXCEPTION_BASE = 0x80000000  # EBase after a reset
VECTOR = 0x180


def run_code(chip: VirtualChip, *words: int, steps: int, **registers: int) -> Cpu:
    """Execute words at CODE. @param registers  r4=1: general register 4"""
    chip.write_ram(v.CODE & 0x1FFFFFFF, struct.pack(f"<{len(words)}I", *words))
    cpu = Cpu(pc=v.CODE, next_pc=v.CODE + 4)
    for name, value in registers.items():
        cpu.r[int(name[1:])] = value
    chip.set_cpu(cpu)
    for _ in range(steps):
        assert chip.step() == Stop.TIME, chip.fault
    return chip.cpu()


MFC0_EPC, MFC0_CAUSE = 0x40027000, 0x40036800  # to v0, v1


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ((0x8C820001,), 4),  # lw v0, 1(a0)
        ((0xA4820001,), 5),  # sh v0, 1(a0)
        ((0x0000000C,), 8),  # syscall
        ((0x0000000D,), 9),  # break
        ((0x20847FFF,), 12),  # addi a0, a0, 0x7fff
        ((0x00840034,), 13),  # teq a0, a0
    ],
)
def test_exceptions(chip: VirtualChip, words: tuple[int, ...], code: int) -> None:
    """EPC is the instruction, Cause says why, and nothing else was changed."""
    chip.write_ram(VECTOR, struct.pack("<2I", MFC0_EPC, MFC0_CAUSE))
    cpu = run_code(chip, *words, steps=3, r4=0x7FFFFFF0)
    assert (cpu.r[2], cpu.r[3] >> 2 & 31, cpu.r[3] >> 31) == (v.CODE, code, 0)
    assert cpu.r[4] == 0x7FFFFFF0


def test_exception_in_a_delay_slot(chip: VirtualChip) -> None:
    """EPC is the branch, and Cause.BD is set."""
    chip.write_ram(VECTOR, struct.pack("<2I", MFC0_EPC, MFC0_CAUSE))
    cpu = run_code(chip, 0x10000010, 0x8C820001, steps=4, r4=0x80010000)  # b .; lw v0, 1(a0)
    assert (cpu.r[2], cpu.r[3] >> 31) == (v.CODE, 1)


def test_store_conditional(chip: VirtualChip) -> None:
    """SC stores after LL and says 1; without an LL it says 0 and stores nothing."""
    ll, sc = 0xC0850000, 0xE0860000  # ll a1, 0(a0); sc a2, 0(a0)
    chip.write_ram(0x10000, struct.pack("<I", 77))
    cpu = run_code(chip, sc, ll, sc, steps=1, r4=0x80010000, r6=5)
    assert cpu.r[6] == 0 and chip.read_ram(0x10000, 4) == struct.pack("<I", 77)
    cpu = run_code(chip, ll, sc, steps=2, r4=0x80010000, r6=5)
    assert (cpu.r[5], cpu.r[6]) == (77, 1) and chip.read_ram(0x10000, 4) == struct.pack("<I", 5)


def test_denormal_results_are_zero_when_asked_for(chip: VirtualChip) -> None:
    """FCSR.FS."""
    mul_s = 0x46020102  # mul.s f4, f0, f2
    for fcsr, wanted in ((0, 0x00400000), (0x01000000, 0)):
        chip.write_ram(v.CODE & 0x1FFFFFFF, struct.pack("<I", mul_s))
        cpu = Cpu(pc=v.CODE, next_pc=v.CODE + 4, fcsr=fcsr)
        cpu.f[0], cpu.f[2] = 0x00800000, 0x3F000000  # the least normal number, a half
        chip.set_cpu(cpu)
        chip.step()
        assert chip.cpu().f[4] == wanted


def test_an_unknown_instruction_stops_the_chip(chip: VirtualChip) -> None:
    chip.write_ram(v.CODE & 0x1FFFFFFF, struct.pack("<I", 0xFFFFFFFF))
    chip.set_cpu(Cpu(pc=v.CODE, next_pc=v.CODE + 4))
    assert chip.step() == Stop.FAULT
    assert "instruction ffffffff at 80001000 is not known here" in chip.fault
