"""Random instructions and what an independent emulator made of them (make_streams.py): vectors.bin.

A stream has CASES cases. Each loads all registers from its block of memory, executes a few random instructions, and
stores all registers to the block; an exception stores its cause, and the case ends. The same bytes run in both
emulators: nothing in them depends on where they are.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from xtensa_programs import code as c

FILE = Path(__file__).parent / "vectors.bin"
STREAMS, CASES = 12, 256
BLOCK = 512  # bytes: what is loaded, then what was stored
OUT = 256
# in a block
A2, SAR, BR, F0, ACCLO, ACCHI, SCOMPARE1, M0, CAUSE, WINDOW = 0, 56, 60, 64, 128, 132, 136, 140, 156, 160
WINDOW_SIZE = OUT - WINDOW
INSTRUCTIONS, AREA = 6, 24  # of a case, and bytes for them
SPECIALS = ((SAR, c.SAR), (BR, c.BR), (ACCLO, c.ACCLO), (ACCHI, c.ACCHI), (SCOMPARE1, c.SCOMPARE1))
HANDLER, ROUTINES = 0x300, 0x340  # in a stream, whose begin is VECBASE


class Random:
    """xorshift64*: the same on every Python."""

    def __init__(self, seed: int) -> None:
        self._state = seed * 0x9E3779B97F4A7C15 + 1 & (1 << 64) - 1

    def bits(self, count: int) -> int:
        self._state ^= self._state >> 12
        self._state ^= self._state << 25 & (1 << 64) - 1
        self._state ^= self._state >> 27
        return (self._state * 0x2545F4914F6CDD1D & (1 << 64) - 1) >> (64 - count)

    def below(self, end: int) -> int:
        return self.bits(32) * end >> 32

    def choice(self, items: tuple[int, ...]) -> int:
        return items[self.below(len(items))]


# ---- state ----

WORDS = (0, 1, 2, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFF8000, 0x8000, 0x7FFF, 31, 32, 0x00FF00FF)
FLOATS = (0, 0x80000000, 0x3F800000, 0xBF800000, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001, 0xFFC12345)
FLOATS += (0x00000001, 0x807FFFFF, 0x00800000, 0x7F7FFFFF, 0x4B000000, 0x4F000000, 0xCF000000, 0x4EFFFFFF, 0x3F000000)


def word(random: Random) -> int:
    kind = random.below(4)
    return random.choice(WORDS) if kind == 0 else random.bits(32) if kind < 3 else random.bits(8)


def number(random: Random) -> int:
    """A float, mostly of everyday size."""
    if random.below(4) == 0:
        return random.choice(FLOATS)
    return random.bits(1) << 31 | 97 + random.below(62) << 23 | random.bits(23)


def block(random: Random) -> bytes:
    """What a case loads. ACCHI is extended, as the register is."""
    words = [word(random) for _ in range(14)] + [random.below(64), random.bits(16)]
    words += [number(random) for _ in range(16)]
    words += [random.bits(32), random.bits(8) - 128 & 0xFFFFFFFF, word(random)]
    words += [random.bits(32) for _ in range(4)] + [0]
    return struct.pack("<40I", *words) + random.bits(62).to_bytes(8, "little") * (WINDOW_SIZE // 8) + bytes(BLOCK - OUT)


# ---- instructions: none uses a0 or a1 but as a base ----


def some(random: Random) -> int:
    return 2 + random.below(14)


RST0 = (1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15)
RST1 = (0, 1, 2, 3, 4, 8, 9, 10, 11, 12, 13)
RST2 = (8, 12, 13, 14, 15)  # that core has no mulsh and muluh, and QEMU's booleans are not those of the manual
RST3 = (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)


def arithmetic(random: Random) -> bytes:
    t, s, r, op1 = some(random), some(random), some(random), random.below(4)
    op2 = random.choice((RST0, RST1, RST2, RST3)[op1])
    if op1 == 1 and op2 in (0, 1) and (op2 & 1 | t) == 0:
        t = 1  # slli by 32
    if op1 == 1 and op2 == 9:
        s = 0
    if op1 == 1 and op2 == 10:
        t = 0
    if op1 == 1 and op2 == 11:
        s = 0
    return c.wide(0, t, s, r, op1, op2)


def single(random: Random) -> bytes:
    """neg, abs, nsa, nsau, ssr, ssl, ssa8l, ssai, extui"""
    t, s, r, kind = some(random), some(random), some(random), random.below(9)
    if kind < 2:
        return c.wide(0, t, kind, r, 0, 6)
    if kind < 4:
        return c.wide(0, t, s, 12 + kind, 0, 4)
    if kind < 7:
        return c.wide(0, 0, s, kind - 4, 0, 4)
    if kind == 7:
        return c.wide(0, random.bits(1), random.bits(4), 4, 0, 4)
    shift, mask = random.below(32), random.below(16)
    return c.wide(0, t, shift & 15, r, 4 | shift >> 4, mask)


def constant(random: Random) -> bytes:
    kind = random.below(6)
    if kind == 0:
        return c.movi(some(random), random.bits(12))
    if kind < 3:
        return c.immediate(2, some(random), some(random), 11 + kind, random.bits(8))
    if kind == 3:
        return c.narrow(12, random.bits(3), some(random), random.bits(4))  # movi.n
    return c.narrow(kind + 6, some(random) if kind == 4 else random.bits(4), some(random), some(random))


def memory(random: Random) -> bytes:
    kind = random.below(11)
    codes, sizes = (0, 1, 2, 4, 5, 6, 9), (1, 2, 4, 1, 2, 4, 2)
    if kind < 7:
        size = sizes[kind]
        offset = (WINDOW + random.below(WINDOW_SIZE // size) * size) // size
        return c.immediate(2, some(random), 1, codes[kind], offset)
    place = WINDOW // 4 + random.below(WINDOW_SIZE // 4)
    if kind == 7:
        return c.immediate(2, some(random), 1, 14, place)  # s32c1i
    return c.immediate(3, random.bits(4), 1, 4 * random.below(2), place)


def skip(random: Random, rest: int) -> bytes:
    """A branch over the next instructions. @param rest  bytes to the end of the area after it; a branch ends there"""
    t, s, distance = some(random), some(random), rest - 1
    kind = random.below(5)
    if kind == 0:
        return c.wide(6, 1 | random.bits(2) << 2, s, distance & 15, distance >> 4 & 15, distance >> 8)
    if kind == 1:
        return c.immediate(6, 2 | random.bits(2) << 2, s, random.bits(4), distance)
    if kind == 2:
        return c.immediate(6, 3 | (2 + random.bits(1)) << 2, s, random.bits(4), distance)
    if kind == 3:
        return c.immediate(6, 7, random.bits(4), random.bits(1), distance)  # bf, bt
    return c.immediate(7, t, s, random.bits(4), distance)


FP0 = (0, 1, 2, 4, 5)
FP1OP = (0, 1, 4, 5, 6)


def floating(random: Random) -> bytes:
    t, s, r, kind = random.bits(4), random.bits(4), random.bits(4), random.below(8)
    if kind < 3:
        return c.wide(0, t, s, r, 10, random.choice(FP0))
    if kind == 3:
        return c.wide(0, t, s, some(random), 10, random.choice((8, 9, 10, 11, 14)))
    if kind == 4:
        return c.wide(0, t, some(random), r, 10, random.choice((12, 13)))
    if kind == 5:
        code = random.choice(FP1OP)
        return c.wide(0, code, some(random) if code == 5 else s, some(random) if code == 4 else r, 10, 15)
    if kind == 6:
        return c.wide(0, t, s, r, 11, 1 + random.below(7))
    return c.wide(0, some(random), s, r, 11, 8 + random.below(6))


def accumulate(random: Random) -> bytes:
    kind = random.choice((2, 3, 6, 7))
    op1 = 4 * (random.below(4) if kind == 7 else 1 + random.below(3)) + random.bits(2)
    r = random.bits(1) << 2 if kind in (2, 6) else 0
    t = random.bits(1) << 2 if kind < 4 else some(random)
    return c.wide(4, t, 0 if kind in (2, 6) else some(random), r, op1, kind)


def exception(random: Random) -> bytes:
    """syscall, ill, or a division by what may be zero"""
    kind = random.below(3)
    if kind == 0:
        return c.wide(0, 0, 0, 5)
    return c.wide(0) if kind == 1 else c.wide(0, some(random), some(random), some(random), 2, 12 + random.bits(2))


MAKERS = (arithmetic, arithmetic, single, constant, memory, floating, floating, accumulate)


def instructions(random: Random) -> bytes:
    """AREA bytes."""
    code = b""
    for _ in range(INSTRUCTIONS):
        room = AREA - len(code) - 3 * (INSTRUCTIONS - 1)
        if room > 0 and random.below(12) == 0 and AREA - len(code) >= 6:
            code += skip(random, AREA - len(code) - 3)
        elif random.below(40) == 0:
            code += exception(random)
        else:
            code += MAKERS[random.below(len(MAKERS))](random)
    return c.padded(code, AREA)


# ---- a stream ----


def handler() -> bytes:
    """Store the cause; continue where the case ends, which EXCSAVE1 says."""
    return b"".join(
        (c.rsr(0, c.EXCCAUSE), c.s32i(0, 1, OUT + CAUSE), c.rsr(0, c.EXCSAVE1), c.wsr(0, c.EPC1), c.RSYNC, c.RFE)
    )


def loads() -> bytes:
    code = c.addi(0, 0, 0)
    code += c.addi(2, 0, AREA) + c.wsr(2, c.EXCSAVE1)
    for place, special in (*SPECIALS, *((M0 + 4 * n, c.M0 + n) for n in range(4))):
        code += c.l32i(2, 1, place) + c.wsr(2, special)
    code += b"".join(c.lsi(n, 1, F0 + 4 * n) for n in range(16)) + c.RSYNC
    return code + b"".join(c.l32i(n, 1, A2 + 4 * (n - 2)) for n in range(2, 16)) + c.RET


def stores() -> bytes:
    code = b"".join(c.s32i(n, 1, OUT + A2 + 4 * (n - 2)) for n in range(2, 16))
    for place, special in (*SPECIALS, *((M0 + 4 * n, c.M0 + n) for n in range(4))):
        code += c.rsr(2, special) + c.s32i(2, 1, OUT + place)
    code += b"".join(c.ssi(n, 1, OUT + F0 + 4 * n) for n in range(16))
    return code + c.addmi(1, 1, BLOCK) + c.RET


def aligned(code: bytes) -> bytes:
    return code + bytes(-len(code) % 4)


def stream(index: int) -> tuple[bytes, bytes, int]:
    """Code, memory, and where in the code it begins; it ends at the end of the code."""
    random = Random(index + 1)
    code = (bytes(HANDLER) + handler()).ljust(ROUTINES, b"\0")
    load = len(code)
    code = aligned(code + loads())
    store = len(code)
    code = aligned(code + stores())
    start = len(code)
    data = b""
    for _ in range(CASES):
        data += block(random)
        code += c.call0(len(code), load)
        code += instructions(random)
        code += c.call0(len(code), store)
    return code, data, start


def read() -> list[bytes]:
    """stored() of each stream's memory."""
    raw = zlib.decompress(FILE.read_bytes())
    size = CASES * OUT
    return [raw[at : at + size] for at in range(0, len(raw), size)]


def stored(memory_after: bytes, before: bytes) -> bytes:
    """Of each block: which bits of what was loaded have changed."""
    found = b""
    for at in range(0, len(before), BLOCK):
        after = memory_after[at + OUT : at + OUT + WINDOW] + memory_after[at + WINDOW : at + OUT]
        change = int.from_bytes(after, "little") ^ int.from_bytes(before[at : at + OUT], "little")
        found += change.to_bytes(OUT, "little")
    return found


def differences(made: bytes, right: bytes) -> list[tuple[int, str]]:
    """Case, and readable: offset in the block, which bits were changed and which should have been."""
    found = []
    for at in range(0, len(right), 4):
        if made[at : at + 4] != right[at : at + 4]:
            a, b = (int.from_bytes(text[at : at + 4], "little") for text in (made, right))
            found.append((at // OUT, f"case {at // OUT} at {at % OUT}: {a:08x}, not {b:08x}"))
    return found
