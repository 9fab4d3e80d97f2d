"""The image's own C library, called in the virtual chip: the bits that a computer's has."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Iterator

import pytest
from wificnc.board.model import Board
from wificnc.build.image import Block, elf_symbols
from wificnc.build.pic32mz import Pic32Build
from wificnc_chips.pic32mz import Cpu, VirtualChip, wired_chip

STACK, RETURN = 0x80070000, 0x80071000
FLUSH = 0x01000000  # FCSR as the firmware has it
COUNT = 300
MASK = (1 << 64) - 1


class Caller:
    """Calls functions of the image by the o32 convention."""

    def __init__(self, chip: VirtualChip, symbols: dict[str, int]) -> None:
        self._chip = chip
        self._symbols = symbols

    def __call__(self, name: str, words: list[int], floats: list[int] | None = None) -> Cpu:
        if name not in self._symbols:
            pytest.skip(f"{name}() is not in the image: nothing uses it")
        at = self._symbols[name]
        cpu = Cpu(pc=at, next_pc=at + 4, fcsr=FLUSH)
        cpu.r[29], cpu.r[31] = STACK, RETURN
        for index, value in enumerate(words[:4]):
            cpu.r[4 + index] = value & 0xFFFFFFFF
        self._chip.write_ram((STACK & 0x1FFFFFFF) + 16, b"".join(struct.pack("<I", w & 0xFFFFFFFF) for w in words[4:]))
        for index, value in enumerate(floats or []):
            cpu.f[12 + 2 * index] = value
        self._chip.set_cpu(cpu)
        for _ in range(20_000):
            self._chip.step()
            if self._chip.cpu().pc == RETURN:
                return self._chip.cpu()
        raise AssertionError(f"{name}() does not return")


@pytest.fixture(scope="module")
def call(board: Board, build: Pic32Build, image: tuple[Block, ...]) -> Iterator[Caller]:
    with wired_chip(board, image) as chip:
        yield Caller(chip, elf_symbols(build.elf.read_bytes()))


def bits(value: float) -> int:
    return int(struct.unpack("<Q", struct.pack("<d", value))[0])


def halves(value: int) -> list[int]:
    return [value & 0xFFFFFFFF, value >> 32 & 0xFFFFFFFF]


def long_result(cpu: Cpu) -> int:
    return int(cpu.r[3]) << 32 | int(cpu.r[2])


def signed(value: int) -> int:
    return value - (1 << 64) if value >> 63 else value


def integers() -> Iterator[tuple[int, int]]:
    """Of every length, and the borders."""
    numbers = random.Random(1)
    for _ in range(COUNT):
        yield numbers.getrandbits(numbers.randint(1, 64)), numbers.getrandbits(numbers.randint(1, 64)) or 1
    for n in (0, 1, 1 << 31, (1 << 32) - 1, 1 << 32, 1 << 63, MASK):
        for d in (1, 2, (1 << 16) + 1, (1 << 32) - 1, 1 << 32, (1 << 32) + 1, 1 << 63, MASK):
            yield n, d


@pytest.mark.parametrize(("name", "wanted"), [("__udivdi3", lambda n, d: n // d), ("__umoddi3", lambda n, d: n % d)])
def test_unsigned_division(call: Caller, name: str, wanted: Callable[[int, int], int]) -> None:
    for n, d in integers():
        assert long_result(call(name, [*halves(n), *halves(d)])) == wanted(n, d), (n, d)


def test_signed_division(call: Caller) -> None:
    """Towards zero, as C has it."""
    for n, d in integers():
        n, d = signed(n), signed(d)
        wanted = abs(n) // abs(d) * (1 if (n < 0) == (d < 0) else -1)
        assert long_result(call("__divdi3", [*halves(n & MASK), *halves(d & MASK)])) == wanted & MASK, (n, d)


def doubles() -> list[float]:
    numbers = random.Random(2)
    found = [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 0.1, 1e15 + 0.5, 4503599627370495.5, 2.0**52, -(2.0**53), 1e300, 1e-300]
    return found + [numbers.uniform(-1, 1) * 10.0 ** numbers.randint(-20, 20) for _ in range(COUNT)]


@pytest.mark.parametrize("name", ["floor", "ceil", "trunc"])
def test_rounding(call: Caller, name: str) -> None:
    for x in doubles():
        wanted = math.copysign(float(getattr(math, name)(x)), x)
        assert call(name, [], [bits(x)]).f[0] == bits(wanted), x


def test_fmod(call: Caller) -> None:
    values = doubles()
    for x, y in zip(values, reversed(values), strict=True):
        if y != 0.0:
            assert call("fmod", [], [bits(x), bits(y)]).f[0] == bits(math.fmod(x, y)), (x, y)


def test_frexp_and_ldexp(call: Caller) -> None:
    pointer = 0x80072000
    for x in doubles():
        fraction, exponent = math.frexp(x)
        cpu = call("frexp", [0, 0, pointer], [bits(x)])
        assert cpu.f[0] == bits(fraction), x
        for shift in (exponent, -3, 1000, -40):
            try:
                wanted = math.ldexp(fraction, shift)
            except OverflowError:
                continue
            assert call("ldexp", [0, 0, shift], [bits(fraction)]).f[0] == bits(wanted), (fraction, shift)


def test_moving_memory(call: Caller, board: Board, image: tuple[Block, ...]) -> None:
    """memcpy, memmove with overlap both ways, memset: at every alignment, and not a byte beyond."""
    base = 0x80074000
    chip = call._chip
    numbers = random.Random(3)
    for _ in range(100):
        before = numbers.randbytes(64)
        to, start, count = numbers.randint(0, 20), numbers.randint(0, 20), numbers.randint(0, 40)
        chip.write_ram(base & 0x1FFFFFFF, before)
        call("memmove" if "memmove" in call._symbols else "memcpy", [base + to, base + start, count])
        wanted = bytearray(before)
        wanted[to : to + count] = before[start : start + count]
        if "memmove" in call._symbols or to + count <= start or start + count <= to or to <= start:
            assert chip.read_ram(base & 0x1FFFFFFF, 64) == bytes(wanted), (to, start, count)
        chip.write_ram(base & 0x1FFFFFFF, before)
        call("memset", [base + to, 0x15A, count])
        wanted = bytearray(before)
        wanted[to : to + count] = b"\x5a" * count
        assert chip.read_ram(base & 0x1FFFFFFF, 64) == bytes(wanted), (to, count)


def test_searching_text(call: Caller) -> None:
    text, wanted = 0x80074000, 0x80074100
    for line, letters in (("", "#%"), ("abc", ""), ("abc", "#%"), ("#", "#%"), ("ab%#", "#%"), ("ab\xe4#", "\xe4")):
        for at, string in ((text, line), (wanted, letters)):
            call._chip.write_ram(at & 0x1FFFFFFF, string.encode("latin-1") + b"\0")
        span = next((at for at, letter in enumerate(line) if letter in letters), len(line))
        assert call("strcspn", [text, wanted]).r[2] == span, (line, letters)
        assert call("strpbrk", [text, wanted]).r[2] == (text + span if span < len(line) else 0), (line, letters)
