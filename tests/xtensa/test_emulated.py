"""The core as Xtensa code in an emulator: its unit tests pass there, and every step edge is this computer's."""

from __future__ import annotations

import ctypes
import random
import struct
import subprocess

import numpy as np
import pytest
from everywhere import ROOT, TRACE_DIGEST, UNIT_TESTS, differences, texts
from patience import HANG_S
from wificnc.build.compiler import locate_compiler
from xtensa.emulate import HERE as QEMU
from xtensa.emulate import build, controller_sources, missing, run

OUTPUT = ROOT / "build" / "xtensa" / "qemu"

needs_emulator = pytest.mark.skipif(missing() != "", reason=missing())


@needs_emulator
def test_unit_tests_pass_as_xtensa_code() -> None:
    program = build(ROOT, [*controller_sources(ROOT), UNIT_TESTS], OUTPUT / "core")
    assert run(program, b"", 4 * HANG_S).splitlines() == ["0 failures"]


@needs_emulator
def test_every_step_edge_and_answer_is_this_computers() -> None:
    program = build(ROOT, [*controller_sources(ROOT), TRACE_DIGEST], OUTPUT / "trace")
    assert differences(run(program, texts(), 4 * HANG_S)) == []


# ---- the arithmetic that the emulated chip would have in its ROM ----

SPECIAL = [0.0, -0.0, 1.0, -1.0, 5e-324, 2.2250738585072014e-308, 2.225073858507201e-308, 1.7976931348623157e308]
SPECIAL += [float("inf"), float("-inf"), float("nan"), 1.5, 1 + 2**-52, 2.0**53, 2.0**-1040, 0.1]


@pytest.fixture(scope="module")
def arithmetic(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    library = tmp_path_factory.mktemp("softfloat") / "softfloat.so"
    flags = ["-std=gnu11", "-O2", "-shared", "-fPIC", "-fno-builtin"]
    subprocess.run([*locate_compiler(), *flags, str(QEMU / "softfloat.c"), "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


def doubles(count: int) -> list[float]:
    """Any bits, numbers of like size, and special ones."""
    rng = random.Random(5)
    found = [struct.unpack("<d", rng.randbytes(8))[0] for _ in range(count)]
    found += [rng.uniform(-10, 10) * 2.0 ** rng.randrange(-3, 3) for _ in range(count)]
    return found + SPECIAL


def same(first: float, second: float) -> bool:
    return (first != first and second != second) or struct.pack("<d", first) == struct.pack("<d", second)


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div"])
def test_double_arithmetic_equals_the_hardwares(arithmetic: ctypes.CDLL, name: str) -> None:
    function = getattr(arithmetic, f"__{name}df3")
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.c_double]
    operation = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide}[name]
    values, rng = doubles(20_000), random.Random(7)
    pairs = [(a, b) for a in SPECIAL for b in SPECIAL] + [(a, rng.choice(values)) for a in values]
    with np.errstate(all="ignore"):
        wrong = [(a, b) for a, b in pairs if not same(function(a, b), float(operation(np.float64(a), np.float64(b))))]
    assert wrong == []


@pytest.mark.parametrize("name", ["add", "sub", "mul"])
def test_single_arithmetic_equals_the_hardwares(arithmetic: ctypes.CDLL, name: str) -> None:
    function = getattr(arithmetic, f"__{name}sf3")
    function.restype, function.argtypes = ctypes.c_float, [ctypes.c_float, ctypes.c_float]
    operation = {"add": np.add, "sub": np.subtract, "mul": np.multiply}[name]
    rng = np.random.default_rng(3)
    bits = rng.integers(0, 2**32, 40_000, dtype=np.uint32).view(np.float32)
    near = rng.normal(size=40_000).astype(np.float32)
    with np.errstate(all="ignore"):
        for a, b in ((bits, np.roll(bits, 1)), (near, np.roll(near, 1)), (bits, near)):
            wanted = operation(a, b)
            found = np.array([function(float(x), float(y)) for x, y in zip(a, b, strict=True)], np.float32)
            assert np.array_equal(found, wanted, equal_nan=True)


def test_conversions_equal_the_hardwares(arithmetic: ctypes.CDLL) -> None:
    narrow, widen = arithmetic.__truncdfsf2, arithmetic.__extendsfdf2
    narrow.restype, narrow.argtypes = ctypes.c_float, [ctypes.c_double]
    widen.restype, widen.argtypes = ctypes.c_double, [ctypes.c_float]
    to_int, from_int = arithmetic.__fixdfsi, arithmetic.__floatsidf
    to_int.restype, to_int.argtypes = ctypes.c_int32, [ctypes.c_double]
    from_int.restype, from_int.argtypes = ctypes.c_double, [ctypes.c_int32]
    with np.errstate(all="ignore"):
        for value in doubles(20_000):
            single = float(np.float32(value))
            assert same(float(np.float32(narrow(value))), single)
            assert same(widen(single), single)
            if abs(value) < 2**31:
                assert to_int(value) == int(value)
    for number in (0, 1, -1, 2**31 - 1, -(2**31), 16777217, -123456789):
        assert from_int(number) == float(number)


def test_wide_integers_divide_and_multiply(arithmetic: ctypes.CDLL) -> None:
    rng = random.Random(9)
    divide, rest = arithmetic.__udivdi3, arithmetic.__umoddi3
    product, short = arithmetic.__muldi3, arithmetic.__divsi3
    for function in (divide, rest, product):
        function.restype, function.argtypes = ctypes.c_uint64, [ctypes.c_uint64, ctypes.c_uint64]
    short.restype, short.argtypes = ctypes.c_int32, [ctypes.c_int32, ctypes.c_int32]
    for _ in range(20_000):
        a, b = rng.getrandbits(64) >> rng.randrange(64), (rng.getrandbits(64) >> rng.randrange(64)) or 1
        assert divide(a, b) == a // b and rest(a, b) == a % b and product(a, b) == a * b % 2**64
        x, y = a % 2**31 - 2**30, b % 2**31 - 2**30 or 1
        assert short(x, y) == int(x / y)
