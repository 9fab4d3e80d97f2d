"""Random instructions and their surroundings, and what they must leave: shared by generator and test.

A vector is an instruction with the state before it, which follows from its number alone, and the changes that an
independent emulator made of it. The file is small because only changes are stored.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

FILE = Path(__file__).parent / "vectors.bin"

CODE = 0x80001000
WINDOW = 0x80010000  # memory that loads and stores reach
WINDOW_SIZE = 64
BASE = 29  # the register that points into its middle
SLOT = 0x27DE0001  # addiu fp, fp, 1: what follows every instruction
CONDITIONS = 0xFE800000  # of FCSR: the rest, flags of exceptions, no one reads

# What changed: general register n, HI, LO, FCSR, PC; floating-point register n; byte n of the window
GENERAL, HI, LO, FCSR, PC, FLOAT, BYTE = 0, 32, 33, 34, 35, 64, 128


class Random:
    """xorshift64*: the same numbers with every version of Python."""

    def __init__(self, seed: int) -> None:
        self._state = (seed * 0x9E3779B97F4A7C15 + 0x1234567) & 0xFFFFFFFFFFFFFFFF or 1

    def bits(self, count: int) -> int:
        x = self._state
        x ^= x >> 12
        x ^= x << 25 & 0xFFFFFFFFFFFFFFFF
        x ^= x >> 27
        self._state = x
        return (x * 0x2545F4914F6CDD1D & 0xFFFFFFFFFFFFFFFF) >> (64 - count)

    def below(self, end: int) -> int:
        return self.bits(32) * end >> 32

    def choice(self, items: list[int]) -> int:
        return items[self.below(len(items))]


@dataclass
class State:
    """All that an instruction can see."""

    r: list[int]
    f: list[int]
    hi: int
    lo: int
    fcsr: int
    window: bytes


WORDS = [0, 1, 2, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFF8000, 0x8000, 0x00FF00FF, 31, 32]
SINGLES = [
    0,
    0x80000000,
    0x3F800000,
    0xBF800000,
    0x7F800000,
    0xFF800000,
    0x4B000000,
    0x4EFFFFFF,
    0x4F000000,
    0x00800000,
]
DOUBLES = [
    *(0, 0x8000000000000000, 0x3FF0000000000000, 0x7FF0000000000000, 0xFFF0000000000000, 0x41DFFFFFFFC00000),
    *(0xC1E0000000000000, 0x4330000000000000, 0x3FE0000000000000, 0x0010000000000000, 0x4024000000000000),
]


def word(random: Random) -> int:
    kind = random.below(4)
    return random.choice(WORDS) if kind == 0 else random.bits(32) if kind < 3 else random.bits(8)


def single(random: Random) -> int:
    """Mostly numbers of everyday size: sign, exponent near 0, fraction."""
    if random.below(5) == 0:
        return random.choice(SINGLES)
    return random.bits(1) << 31 | (97 + random.below(60)) << 23 | random.bits(23)


def double(random: Random) -> int:
    if random.below(5) == 0:
        return random.choice(DOUBLES)
    return random.bits(1) << 63 | (993 + random.below(60)) << 52 | random.bits(52)


def state(number: int) -> State:
    random = Random(number)
    r = [0] + [word(random) for _ in range(31)]
    r[BASE] = WINDOW + WINDOW_SIZE // 2
    f = [single(random) | random.bits(32) << 32 if n % 2 else double(random) for n in range(32)]
    window = bytes(random.bits(8) for _ in range(WINDOW_SIZE))
    return State(r, f, word(random), word(random), random.bits(8) << 25 & CONDITIONS, window)


# ---- instructions ----

SPECIAL_RRR = [0x04, 0x06, 0x07, 0x0A, 0x0B, 0x21, 0x23, 0x24, 0x25, 0x26, 0x27, 0x2A, 0x2B]
SPECIAL_SHIFT = [0x00, 0x02, 0x03]
SPECIAL_MULTIPLY = [0x18, 0x19, 0x1A, 0x1B]
SPECIAL_HILO = [0x10, 0x11, 0x12, 0x13]
SPECIAL2 = [0x00, 0x01, 0x02, 0x04, 0x05, 0x20, 0x21]
IMMEDIATE = [0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F]
BRANCH = [0x04, 0x05, 0x06, 0x07, 0x14, 0x15, 0x16, 0x17]
MEMORY = {0x20: 1, 0x21: 2, 0x22: 1, 0x23: 4, 0x24: 1, 0x25: 2, 0x26: 1, 0x28: 1, 0x29: 2, 0x2A: 1, 0x2B: 4, 0x2E: 1}
MEMORY_FLOAT = {0x31: 4, 0x35: 8, 0x39: 4, 0x3D: 8}
FLOAT_ARITHMETIC = [0x00, 0x01, 0x02, 0x03, 0x05, 0x06, 0x07]
FLOAT_CONVERT = [0x08, 0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x24, 0x25]


def instruction(number: int) -> int:
    """A random one of the kinds below, each as often as the others."""
    random = Random(number ^ 0x5EED0000)
    makers = (rrr, shift, multiply, hilo, special2, bits, immediate, branch, regimm, memory, memory_float)
    makers += (arithmetic, compare, convert, to_float, move, conditional, branch_on_condition, indexed)
    return makers[number % len(makers)](random)


def fields(random: Random) -> tuple[int, int, int]:
    return random.below(32), random.below(32), random.below(29)


def rrr(random: Random) -> int:
    s, t, d = fields(random)
    return s << 21 | t << 16 | d << 11 | random.choice(SPECIAL_RRR)


def shift(random: Random) -> int:
    _, t, d = fields(random)
    return t << 16 | d << 11 | random.below(32) << 6 | random.choice(SPECIAL_SHIFT)


def multiply(random: Random) -> int:
    s, t, _ = fields(random)
    return s << 21 | (t or 1) << 16 | random.choice(SPECIAL_MULTIPLY)


def hilo(random: Random) -> int:
    s, _, d = fields(random)
    code = random.choice(SPECIAL_HILO)
    return (s << 21 if code & 1 else d << 11) | code


def special2(random: Random) -> int:
    s, _, d = fields(random)
    code = random.choice(SPECIAL2)
    if code >= 0x20:
        return 0x1C << 26 | s << 21 | d << 16 | d << 11 | code
    return 0x1C << 26 | s << 21 | random.below(32) << 16 | (d << 11 if code == 2 else 0) | code


def bits(random: Random) -> int:
    """ext, ins, wsbh, seb, seh, rotr, rotrv"""
    s, t, d = fields(random)
    kind = random.below(7)
    low = random.below(32)
    if kind == 0:
        return 0x1F << 26 | s << 21 | d << 16 | random.below(32 - low) << 11 | low << 6
    if kind == 1:
        return 0x1F << 26 | s << 21 | d << 16 | (low + random.below(32 - low)) << 11 | low << 6 | 4
    if kind < 5:
        return 0x1F << 26 | t << 16 | d << 11 | (0x02, 0x10, 0x18)[kind - 2] << 6 | 0x20
    if kind == 5:
        return 1 << 21 | t << 16 | d << 11 | low << 6 | 2
    return s << 21 | t << 16 | d << 11 | 1 << 6 | 6


def immediate(random: Random) -> int:
    s, _, d = fields(random)
    code = random.choice(IMMEDIATE)
    return code << 26 | (0 if code == 0x0F else s) << 21 | d << 16 | random.bits(16)


def branch(random: Random) -> int:
    s, t, _ = fields(random)
    code = random.choice(BRANCH)
    if code >= 0x14:  # Unicorn takes a likely branch that can never be taken for two instructions
        s = s or 1
        t = (s + 1) % 32
    return code << 26 | s << 21 | (t if code & 3 < 2 else 0) << 16 | random.bits(10)


def regimm(random: Random) -> int:
    s, _, _ = fields(random)
    kind = random.choice([0x00, 0x01, 0x02, 0x03, 0x10, 0x11, 0x12, 0x13])
    return 1 << 26 | (s % 30 + 1) << 21 | kind << 16 | random.bits(10)


def offset(random: Random, size: int) -> int:
    return (random.below(WINDOW_SIZE // size) * size - WINDOW_SIZE // 2) & 0xFFFF


def memory(random: Random) -> int:
    code = random.choice(list(MEMORY))
    return code << 26 | BASE << 21 | random.below(29) << 16 | offset(random, MEMORY[code])


def memory_float(random: Random) -> int:
    code = random.choice(list(MEMORY_FLOAT))
    return code << 26 | BASE << 21 | random.below(32) << 16 | offset(random, MEMORY_FLOAT[code])


def float_fields(random: Random) -> tuple[int, int, int, int]:
    """Format, then three registers whose numbers have that format."""
    is_single = random.bits(1)
    a, b, c = (2 * random.below(16) + is_single for _ in range(3))
    return 16 + 1 - is_single, a, b, c


def arithmetic(random: Random) -> int:
    form, a, b, c = float_fields(random)
    code = random.choice(FLOAT_ARITHMETIC)
    return 0x11 << 26 | form << 21 | (b if code < 4 else 0) << 16 | a << 11 | c << 6 | code


def compare(random: Random) -> int:
    form, a, b, _ = float_fields(random)
    return 0x11 << 26 | form << 21 | b << 16 | a << 11 | random.below(8) << 8 | 0x30 | random.below(8)


def convert(random: Random) -> int:
    form, a, _, c = float_fields(random)
    kind = random.below(12)
    if kind < 10:
        return 0x11 << 26 | form << 21 | a << 11 | c << 6 | FLOAT_CONVERT[kind]
    return 0x11 << 26 | form << 21 | a << 11 | c << 6 | (0x21 if form == 16 else 0x20)


def to_float(random: Random) -> int:
    """cvt from W and L; sqrt; moves between the register files"""
    form, a, _, c = float_fields(random)
    kind = random.below(8)
    if kind < 4:
        return 0x11 << 26 | (20 + kind % 2) << 21 | a << 11 | c << 6 | (0x20 + kind // 2)
    if kind == 4:
        return 0x11 << 26 | form << 21 | a << 11 | c << 6 | 0x04
    return 0x11 << 26 | (0, 3, 4)[kind - 5] << 21 | random.below(29) << 16 | a << 11


def move(random: Random) -> int:
    form, a, b, c = float_fields(random)
    return 0x11 << 26 | form << 21 | b << 16 | a << 11 | c << 6 | (0x12 + random.bits(1))


def conditional(random: Random) -> int:
    form, a, _, c = float_fields(random)
    select = random.below(8) << 18 | random.bits(1) << 16
    if random.bits(1):
        return random.below(32) << 21 | select | random.below(29) << 11 | 1
    return 0x11 << 26 | form << 21 | select | a << 11 | c << 6 | 0x11


def branch_on_condition(random: Random) -> int:
    return 0x11 << 26 | 8 << 21 | random.below(8) << 18 | random.bits(2) << 16 | random.bits(10)


def indexed(random: Random) -> int:
    """lwxc1, ldxc1, swxc1, sdxc1, with $zero as the index"""
    code = random.choice([0x00, 0x01, 0x08, 0x09])
    f = random.below(32)
    return 0x13 << 26 | BASE << 21 | (f << 11 if code >= 8 else f << 6) | code


# ---- the file ----


@dataclass
class Vector:
    """What an instruction must leave."""

    number: int
    word: int
    changes: dict[int, int] = field(default_factory=dict)


def write(vectors: list[Vector]) -> None:
    raw = bytearray()
    for vector in vectors:
        raw += struct.pack("<IIB", vector.number, vector.word, len(vector.changes))
        for what, value in vector.changes.items():
            raw += struct.pack("<BQ", what, value)
    FILE.write_bytes(zlib.compress(bytes(raw), 9))


def read() -> Iterator[Vector]:
    raw = zlib.decompress(FILE.read_bytes())
    at = 0
    while at < len(raw):
        number, code, count = struct.unpack_from("<IIB", raw, at)
        at += 9
        changes = dict(struct.unpack_from("<BQ", raw, at + 9 * index) for index in range(count))
        at += 9 * count
        yield Vector(number, code, changes)


def changes(before: State, after: State, pc: int) -> dict[int, int]:
    """What differs; PC always."""
    found = {PC: pc - CODE}
    found.update({GENERAL + n: after.r[n] for n in range(32) if after.r[n] != before.r[n]})
    found.update({FLOAT + n: after.f[n] for n in range(32) if after.f[n] != before.f[n]})
    found.update({BYTE + n: after.window[n] for n in range(WINDOW_SIZE) if after.window[n] != before.window[n]})
    for what, a, b in ((HI, before.hi, after.hi), (LO, before.lo, after.lo), (FCSR, before.fcsr, after.fcsr)):
        if a != b:
            found[what] = b
    return found
