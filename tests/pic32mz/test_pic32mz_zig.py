"""The image that zig builds: another compiler, the same steps."""

from __future__ import annotations

import importlib.util
import random
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from chip_controller import BANNER, Controller
from mips.isr import disassemble, read_disassembly, violations
from stack_use import DEEPEST, STACK_BUDGET, paint_stack, stack_used
from test_pic32mz_libc import Caller, bits, halves, long_result, signed
from test_pic32mz_motion import LINES, chip_trace, host_trace
from wificnc.board.model import Board
from wificnc.build.checkout import checkout_root
from wificnc.build.image import elf_symbols, read_hex
from wificnc.build.mips import COMPILER, find_compiler
from wificnc.build.pic32mz import RAM_BUDGET, Pic32Build, build_pic32mz
from wificnc.errors import BuildError
from wificnc_chips.pic32mz import wired_chip

MAX_FLASH_BYTES = 320 * 1024  # clang has no -flto here that keeps the ABI, and its code for MIPS is larger
Test = TypeVar("Test", bound=Callable[..., None])

HAS_ZIG = importlib.util.find_spec("ziglang") is not None


def needs_zig(test: Test) -> Test:
    """One build for all of them, as CI makes it: an image that nothing runs may never start."""
    skip = pytest.mark.skipif(not HAS_ZIG, reason="no ziglang here: pip install ziglang")
    return pytest.mark.slow(skip(test))  # type: ignore[no-any-return]


# Lines, and what they are answered.
SHORT_FORM = [
    ("$", r"\[HLP:.*\r\nok\r\n$"),
    ("$$", r"\$0=[\s\S]*\$132=[\s\S]*ok\r\n$"),
    ("$I", r"\[VER:[\s\S]*ok\r\n$"),
    ("$#", r"\[G54:[\s\S]*\[TLO:[\s\S]*ok\r\n$"),
    ("$G", r"\[GC:G0 G54 G17 G21 G90 G94"),
    ("$N", r"\$N0=[\s\S]*ok\r\n$"),
    ("$999=1", r"^error:3\r\n$"),
    ("$20=1", r"^error:10\r\n$"),
    ("G1X1", r"^error:22\r\n$"),
    ("X1.2.3", r"^error:1\r\n$"),
    ("G2X5F100", r"^error:35\r\n$"),
    ("$C\nG1X5F100\n$C", r"^\[MSG:Enabled\]\r\nok\r\nok\r\n"),
    ("$J=G91X1F500", r"^ok\r\n$"),
    ("#1=[SQRT[2]*5]\nG1X#1F2000", r"^ok\r\nok\r\n$"),
    ("G91\nG2X2Y0I1J0F1000\nG90", r"^ok\r\nok\r\nok\r\n$"),
    ("G10L2P2X3\nG55\nG54", r"^ok\r\nok\r\nok\r\n$"),
    ("M3S500\nM5\nM8\nM9", r"^(ok\r\n){4}$"),
    ("G4P0.01", r"^ok\r\n$"),
]


@pytest.fixture(scope="module")
def zig(board: Board) -> Pic32Build:
    return build_pic32mz(board, cc="zig", output=checkout_root() / "build" / f"{board.id}-zig")


@pytest.fixture(scope="module")
def controller(board: Board, zig: Pic32Build) -> Iterator[Controller]:
    with Controller(board, read_hex(zig.hex.read_text())) as controller:
        paint_stack(controller, zig)
        assert controller.boot() == BANNER
        for axis in range(len(board.axes)):
            controller.fine(f"$11{axis}=5000", f"$12{axis}=500")
        yield controller


@needs_zig
def test_size(zig: Pic32Build) -> None:
    """More than the budget that gcc's image keeps, and it is reported; the RAM, and so all buffers, are the same."""
    assert zig.flash_bytes <= MAX_FLASH_BYTES and zig.ram_bytes <= RAM_BUDGET


@needs_zig
def test_the_same_steps_as_the_host(controller: Controller, tmp_path: Path) -> None:
    """Lines, corners and arcs: steps and directions exactly, pulses and pauses as long as they must."""
    job = "\n".join(["G90G21G17", LINES["corners"], LINES["arcs"]])
    host, chip = host_trace(tmp_path, job), chip_trace(controller, job)
    assert len(host) == len(chip) > 10_000
    np.testing.assert_array_equal(chip[:, 1], host[:, 1])
    np.testing.assert_array_equal(chip[:, 2] & chip[:, 1], host[:, 2] & host[:, 1])
    timing, pulses = controller.board.timing, controller.chip.pulses()
    assert min(pulses.high, pulses.low) * 5 >= timing.step_pulse_ns and pulses.setup * 5 >= timing.dir_setup_ns


@needs_zig
@pytest.mark.skipif(shutil.which("mipsel-linux-gnu-objdump") is None, reason="no mipsel-linux-gnu-objdump here")
def test_interrupt_handlers_keep_their_rules(zig: Pic32Build) -> None:
    assert violations(read_disassembly(disassemble(zig.elf))) == []


@needs_zig
@pytest.mark.parametrize(("lines", "wanted"), SHORT_FORM)
def test_the_checklists_short_form(controller: Controller, lines: str, wanted: str) -> None:
    """A line of each section of tests/grbl/checklist.toml."""
    controller.realtime("\x18", 0.3)
    said = "".join(controller.send(line) for line in lines.split("\n"))
    assert re.search(wanted, said), said
    controller.rest()


@needs_zig
def test_stack(controller: Controller, zig: Pic32Build) -> None:
    """After all of the above, and what takes most of it."""
    for line in DEEPEST:
        controller.send(line)
    controller.rest()
    controller.realtime("\x18", 0.3)
    assert 0 < stack_used(controller, zig) <= STACK_BUDGET


@needs_zig
def test_settings_and_switches(controller: Controller, board: Board) -> None:
    controller.fine("$130=300")
    controller.chip.power_on()
    assert controller.run(0.05).endswith(BANNER)
    assert "$130=300.000\r\n" in controller.send("$$")
    controller.fine("G91G1X5F600")
    controller.run(0.1)
    controller.at(0.0, "estop", 1)
    controller.run(0.001)
    stood = controller.stands()
    controller.run(1.0)
    assert "ALARM:50\r\n" in controller.heard and controller.stands() == stood


# ---- what clang calls for, and gcc makes itself (libc/convert.c) ----


def integers() -> list[int]:
    pick = random.Random(3)
    borders = [
        0,
        1,
        (1 << 24) + 1,
        (1 << 53) + 1,
        (1 << 53) + 3,
        (1 << 63) - 1,
        1 << 63,
        (1 << 63) + 1025,
        (1 << 64) - 1,
    ]
    return borders + [pick.getrandbits(pick.randint(1, 64)) for _ in range(200)]


@needs_zig
def test_conversions(zig: Pic32Build, board: Board) -> None:
    """As a computer rounds them: to the nearest, once."""
    with wired_chip(board, read_hex(zig.hex.read_text())) as chip:
        call = Caller(chip, elf_symbols(zig.elf.read_bytes()))
        for n in integers():
            signed_n = signed(n)
            assert call("__floatdidf", halves(n)).f[0] == bits(float(signed_n))
            assert call("__floatdisf", halves(n)).f[0] & 0xFFFFFFFF == single(np.int64(signed_n))
            assert call("__floatundisf", halves(n)).f[0] & 0xFFFFFFFF == single(np.uint64(n))
            value = float(n % (1 << 62)) / 8
            assert long_result(call("__fixdfdi", [], [bits(-value)])) == -int(value) % (1 << 64)
            assert long_result(call("__fixunsdfdi", [], [bits(float(n >> 1))])) == int(float(n >> 1))


def single(value: np.int64 | np.uint64) -> int:
    return int(np.float32(value).view(np.uint32))


# ---- which compiler it is ----


@pytest.mark.parametrize(
    ("has_gcc", "has_zig", "wanted", "name"),
    [
        (True, True, None, "gcc"),
        (False, True, None, "zig"),
        (True, True, "zig", "zig"),
        (True, False, "gcc", "gcc"),
    ],
)
def test_which_compiler(has_gcc: bool, has_zig: bool, wanted: str | None, name: str) -> None:
    found = find_compiler(wanted, lambda program: f"/usr/bin/{program}" if has_gcc else None, lambda: has_zig)
    assert found.name == name


@pytest.mark.parametrize(
    ("has_gcc", "has_zig", "wanted", "said"),
    [
        (False, False, None, f"there is no {COMPILER} and no ziglang"),
        (True, False, "zig", "there is no ziglang"),
        (False, True, "gcc", f"there is no {COMPILER}"),
    ],
)
def test_no_compiler(has_gcc: bool, has_zig: bool, wanted: str | None, said: str) -> None:
    with pytest.raises(BuildError, match=said) as caught:
        find_compiler(wanted, lambda program: f"/usr/bin/{program}" if has_gcc else None, lambda: has_zig)
    assert "pip install ziglang" in (caught.value.hint or "")
