"""Write vectors.bin: what Unicorn (QEMU's MIPS) makes of random instructions. Before: pip install unicorn.

Instructions whose result is no number, and divisions by zero, are left out: which bits they leave is not fixed.
"""

from __future__ import annotations

import struct
import sys

import vectors as v
from unicorn import UC_ARCH_MIPS, UC_MODE_LITTLE_ENDIAN, UC_MODE_MIPS32, Uc, UcError
from unicorn import mips_const as m

COUNT = 19 * 300
MODEL = m.UC_CPU_MIPS32_74KF
STATUS = 0x24000000  # CU1, FR
END = 0x80002000


def general(n: int) -> int:
    return int(m.UC_MIPS_REG_0) + n


def floating(n: int) -> int:
    return int(m.UC_MIPS_REG_F0) + n


def main() -> int:
    emulator = Uc(UC_ARCH_MIPS, UC_MODE_MIPS32 | UC_MODE_LITTLE_ENDIAN)
    emulator.ctl_set_cpu_model(MODEL)
    emulator.mem_map(0, 1 << 20)
    emulator.reg_write(m.UC_MIPS_REG_CP0_STATUS, STATUS)
    found, left_out = [], 0
    for number in range(1, COUNT + 1):
        code = v.instruction(number)
        vector = run(emulator, number, code)
        if vector is None:
            left_out += 1
        else:
            found.append(vector)
    v.write(found)
    print(f"{len(found)} vectors, {left_out} left out, {v.FILE.stat().st_size} bytes")
    return 0


def run(emulator: Uc, number: int, code: int) -> v.Vector | None:
    before = v.state(number)
    if is_undefined(before, code):
        return None
    load(emulator, before, code)
    try:
        emulator.emu_start(v.CODE, END, count=2)
    except UcError as err:
        print(f"{number}: {code:08x}: {err}", file=sys.stderr)
        return None
    after = save(emulator)
    if any(is_no_number(after.f[n], n) and after.f[n] != before.f[n] for n in range(32)):
        return None
    return v.Vector(number, code, v.changes(before, after, emulator.reg_read(m.UC_MIPS_REG_PC)))


def is_undefined(state: v.State, code: int) -> bool:
    """Divisions by zero, and of the least number by -1."""
    if code & 0xFC0007FE != 0x1A:
        return False
    numerator, divisor = state.r[code >> 21 & 31], state.r[code >> 16 & 31]
    return divisor == 0 or (numerator, divisor) == (1 << 31, 0xFFFFFFFF)


def load(emulator: Uc, state: v.State, code: int) -> None:
    emulator.mem_write(v.CODE & 0x1FFFFFFF, struct.pack("<3I", code, v.SLOT, v.SLOT))
    emulator.mem_write(v.WINDOW & 0x1FFFFFFF, state.window)
    for n in range(32):
        emulator.reg_write(general(n), state.r[n])
        emulator.reg_write(floating(n), state.f[n])
    emulator.reg_write(m.UC_MIPS_REG_HI, state.hi)
    emulator.reg_write(m.UC_MIPS_REG_LO, state.lo)
    set_fcsr(emulator, state.fcsr)
    emulator.ctl_flush_tb()


def set_fcsr(emulator: Uc, value: int) -> None:
    """By an instruction: the API has no such register."""
    emulator.mem_write(0x3000, struct.pack("<2I", 0x44C1F800, 0))  # ctc1 at, $31
    kept = emulator.reg_read(general(1))
    emulator.reg_write(general(1), value)
    emulator.emu_start(0x80003000, 0x80003004, count=1)
    emulator.reg_write(general(1), kept)


def get_fcsr(emulator: Uc) -> int:
    emulator.mem_write(0x3010, struct.pack("<2I", 0x4441F800, 0))  # cfc1 at, $31
    kept = emulator.reg_read(general(1))
    emulator.emu_start(0x80003010, 0x80003014, count=1)
    value = int(emulator.reg_read(general(1)))
    emulator.reg_write(general(1), kept)
    return value


def save(emulator: Uc) -> v.State:
    pc = emulator.reg_read(m.UC_MIPS_REG_PC)
    r = [emulator.reg_read(general(n)) & 0xFFFFFFFF for n in range(32)]
    f = [emulator.reg_read(floating(n)) for n in range(32)]
    hi, lo = emulator.reg_read(m.UC_MIPS_REG_HI), emulator.reg_read(m.UC_MIPS_REG_LO)
    window = bytes(emulator.mem_read(v.WINDOW & 0x1FFFFFFF, v.WINDOW_SIZE))
    fcsr = get_fcsr(emulator) & v.CONDITIONS
    emulator.reg_write(m.UC_MIPS_REG_PC, pc)
    return v.State(r, f, hi & 0xFFFFFFFF, lo & 0xFFFFFFFF, fcsr, window)


def is_no_number(bits: int, n: int) -> bool:
    if n % 2:
        return bits & 0x7F800000 == 0x7F800000 and bits & 0x007FFFFF != 0
    return bits & 0x7FF0000000000000 == 0x7FF0000000000000 and bits & 0x000FFFFFFFFFFFFF != 0


if __name__ == "__main__":
    sys.exit(main())
