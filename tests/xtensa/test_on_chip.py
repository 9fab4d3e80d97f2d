"""The core and the ESP32's step engine on the virtual chip: what leaves the pins, compared with the PC's.

Here and not in emulators/tests, as it links the objects that this folder's tests compile.
"""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from chip_steps import LATE_TASK_NS, assert_steps_in_time
from numpy.typing import NDArray
from slow import slow_but
from wificnc.simulator.run import SimOptions, simulate
from wificnc_chips import ChipFault
from wificnc_chips.esp32 import CPU_HZ, Chip, VirtualChip
from xtensa import windows
from xtensa.stack import RESERVE
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain
from xtensa_programs.program import BOARDS, Program, build

TASK_MAP = Path(__file__).parents[2] / "targets/esp32/app/task_map.h"

pytestmark = pytest.mark.slow  # compiles a program for the virtual chip

SETTINGS = tuple(f"${base + axis}={value}" for base, value in ((110, 5000), (120, 500)) for axis in range(4))
CYCLES_PER_TICK = 12  # of the step timer, 20 MHz
NS_PER_CYCLE = 1000 / 240
LATENCY_CYCLES = 2  # an instruction is done before the interrupt is taken
REGISTER_CYCLES = 12  # so much longer is one that loads a peripheral's register, with timing: docs/espsim.md
LINE_CYCLES = {Chip.ESP32: 912, Chip.ESP32S3: 456}  # of the cache, from flash: docs/espsim.md

LINES = {
    "one axis": "G91G1X10F3000",
    "slow, with waits between steps": "G91G1X0.1F6\nX0.05",
    "fast": "G91G0X30",
    "diagonal of four axes": "G91G1X10Y7Z3A1F2000\nX-10Y-7Z-3A-1",
    "dwell and back": "G1X5F1000\nG4P0.1\nX0\nG4P0.05\nY5",
}
# What goes deepest: computed lines, jogs, lists, curves, cycles, offsets.
DEEP = """$$
$#
#1=[[[[1+2]*[3-[4/5]]]+SIN[30]]**2]
#<_long>=[#1*ATAN[1]/[2]]
G91G1X[#1/9]F2000
G5X1Y1I0J1P0Q-1
G2X2Y0I1J0F1500
G83Z-2R1Q0.5F900
G80
G10L2P1X1
G4P0.5
$J=G91X1F500"""
ARCS = "G2X10Y0I5J0F1500\nG3X0Y0I-5J0\nG18G2X5Z5I5K0"


@dataclass(frozen=True)
class Built:
    """The program for a chip."""

    kind: Chip
    path: Path


@pytest.fixture(scope="module", params=slow_but(Chip.ESP32.__eq__, Chip), ids=["esp32", "esp32s3"])
def program(request: pytest.FixtureRequest) -> Built:
    try:
        tools: Toolchain = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(tools):
        pytest.skip(said)
    return Built(request.param, build(tools, request.param))


def pc_trace(folder: Path, program: Built, lines: str) -> NDArray[np.int64]:
    """(ns, step mask, direction mask) of the PC's simulation of the same board."""
    job, trace = folder / "job.nc", folder / "trace.csv"
    job.write_text(lines + "\n")
    simulate(SimOptions(file=job, board=BOARDS[program.kind], settings=SETTINGS, trace=trace))
    return np.loadtxt(trace, delimiter=",", skiprows=1, dtype=np.int64, ndmin=2)


def chip_run(program: Built, lines: str, period_us: int, *, timed: bool = False) -> tuple[NDArray[np.int64], Program]:
    """(cycle, step mask, direction mask).
    @param timed  with the costs of pipeline, caches and bus, on both cores; else a cycle an instruction, on one"""
    with VirtualChip(program.kind) as chip:
        chip.timing(timed)
        job = "\n".join((*SETTINGS, lines)) + "\n"
        running = Program(chip, program.kind, program.path, job, period_us, two_cores=timed)
        running.run(30)
        assert running.answers().count("ok") == len(SETTINGS) + len(lines.split("\n"))
        assert "error" not in running.answers() and "ALARM" not in running.answers()
        return running.steps(), running


def same_events(pc: NDArray[np.int64], chip: NDArray[np.int64]) -> None:
    assert len(pc) == len(chip) > 0
    np.testing.assert_array_equal(chip[:, 1], pc[:, 1])
    np.testing.assert_array_equal(chip[:, 2] & chip[:, 1], pc[:, 2] & pc[:, 1])


def lateness_ns(pc: NDArray[np.int64], chip: NDArray[np.int64]) -> NDArray[np.float64]:
    """Of each event, in each motion: from the motion's middle of lateness, as each begins when its line has come."""
    late = (chip[:, 0] - chip[0, 0]) * NS_PER_CYCLE - (pc[:, 0] - pc[0, 0])
    moves = np.flatnonzero(np.diff(pc[:, 0]) > 20_000_000)
    parts = np.split(late, moves + 1)
    return np.concatenate([part - np.median(part) for part in parts])


@pytest.mark.alike(4)
@pytest.mark.parametrize("lines", LINES.values(), ids=LINES.keys())
def test_the_same_steps_as_the_pc_at_the_same_times(program: Built, tmp_path: Path, lines: str) -> None:
    """Every step and direction, each time within one tick of the step timer and the interrupt's latency."""
    pc, (chip, _) = pc_trace(tmp_path, program, lines), chip_run(program, lines, 1000)
    same_events(pc, chip)
    assert np.abs(lateness_ns(pc, chip)).max() <= (CYCLES_PER_TICK + LATENCY_CYCLES) * NS_PER_CYCLE


def test_the_stacks_high_water_mark(program: Built) -> None:
    """Measured; test_firmware.py adds up the frames of each task. Both tasks are one here, and ESP-IDF's functions,
    which RESERVE is for, are missing."""
    sizes = dict(re.findall(r"(\w+)_TASK_STACK = (\d+)", TASK_MAP.read_text()))
    size = int(sizes["CONTROLLER"])
    with VirtualChip(program.kind) as chip:
        running = Program(chip, program.kind, program.path, "\n".join((*SETTINGS, DEEP)) + "\n", 1000)
        running.paint_stack(size)
        running.run(30)
        assert running.answers().count("ok") == len(SETTINGS) + len(DEEP.split("\n"))
        assert 0 < running.stack_used() <= size - RESERVE


@pytest.mark.alike(4)
@pytest.mark.parametrize("lines", LINES.values(), ids=LINES.keys())
def test_with_caches_the_same_steps_as_the_pc(program: Built, tmp_path: Path, lines: str) -> None:
    """On both cores. An instruction of core 1 may wait for a line of the cache, and that for one of the other core."""
    pc, (chip, _) = pc_trace(tmp_path, program, lines), chip_run(program, lines, 1000, timed=True)
    waits_ns = (CYCLES_PER_TICK + LATENCY_CYCLES + 2 * LINE_CYCLES[program.kind]) * NS_PER_CYCLE
    assert_steps_in_time(pc, chip, NS_PER_CYCLE, waits_ns)


@pytest.mark.alike(2)
@pytest.mark.parametrize("lines", [LINES["one axis"], LINES["fast"]], ids=["one axis", "fast"])
def test_with_caches_steps_at_one_speed_come_evenly(program: Built, lines: str) -> None:
    """Between the ramps: a tick of rounding, an instruction that ends first, which may load the time from a register,
    and on an ESP32, whose core 1 has its own cache, hardly a line of it that is waited for."""
    chip, running = chip_run(program, lines, 1000, timed=True)
    between = np.diff(chip[len(chip) // 3 : 2 * len(chip) // 3, 0])
    uneven = np.abs(between - np.median(between))
    even = CYCLES_PER_TICK + LATENCY_CYCLES + REGISTER_CYCLES
    assert uneven.max() <= even + 2 * LINE_CYCLES[program.kind]
    if program.kind == Chip.ESP32:
        assert (uneven > even).sum() <= 2 * running.misses


@pytest.mark.alike(2)
@pytest.mark.parametrize("lines", [LINES["one axis"], LINES["fast"]], ids=["one axis", "fast"])
def test_a_task_that_comes_every_20_ms_makes_the_same_steps(program: Built, tmp_path: Path, lines: str) -> None:
    """A single move is published far enough ahead. Batches end at other places, and times between differ a little."""
    pc, (chip, _) = pc_trace(tmp_path, program, lines), chip_run(program, lines, 20_000)
    same_events(pc, chip)
    assert np.abs(lateness_ns(pc, chip)).max() <= LATE_TASK_NS


@pytest.mark.alike(4)
@pytest.mark.parametrize("period_us", [1000, 20_000])
@pytest.mark.parametrize("lines", [LINES["diagonal of four axes"], ARCS], ids=["diagonal", "arcs"])
def test_no_step_is_lost_when_a_task_is_late(program: Built, tmp_path: Path, lines: str, period_us: int) -> None:
    """Motion may brake and continue; the place where it ends is the same."""
    pc, (chip, _) = pc_trace(tmp_path, program, lines), chip_run(program, lines, period_us)
    for axis in range(4):
        assert net_steps(chip, axis) == net_steps(pc, axis)


def net_steps(events: NDArray[np.int64], axis: int) -> int:
    made = events[(events[:, 1] >> axis & 1) == 1]
    backwards = int((made[:, 2] >> axis & 1).sum())
    return len(made) - 2 * backwards


def test_the_same_run_has_the_same_bits(program: Built) -> None:
    first, second = (chip_run(program, LINES["diagonal of four axes"], 1000)[0] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_pulses_and_pauses(program: Built) -> None:
    """High and low at least the board's step pulse; directions are stable before a step."""
    with VirtualChip(program.kind) as chip:
        running = Program(
            chip, program.kind, program.path, "\n".join((*SETTINGS, LINES["fast"], "G1X-5F9000")) + "\n", 1000
        )
        running.run(30)
        edges = chip.edges()
    board, pins = running.board, running.board.pin_names()
    step, direction = (int(pins[name].removeprefix("GPIO")) for name in ("step_x", "dir_x"))
    steps = [(cycle, level) for cycle, pin, level in edges if pin == step]
    turns = [cycle for cycle, pin, _ in edges if pin == direction]
    widths = np.diff([cycle for cycle, _ in steps]) * NS_PER_CYCLE
    assert widths.min() >= board.timing.step_pulse_ns
    rises = np.array([cycle for cycle, level in steps if level])
    assert turns
    for turn in turns:
        later = rises[rises > turn]
        assert len(later) == 0 or (later[0] - turn) * NS_PER_CYCLE >= board.timing.dir_setup_ns


def segments(elf: bytes) -> list[tuple[int, int]]:
    """Address and size in the file of each that is loaded."""
    table, size, count = (*struct.unpack_from("<I", elf, 28), *struct.unpack_from("<HH", elf, 42))
    headers = [struct.unpack_from("<6I", elf, table + n * size) for n in range(count)]
    return [(address, in_file) for kind, _, address, _, in_file, _ in headers if kind == 1 and in_file]


def test_esptools_image_is_the_same_program(program: Built, tmp_path: Path) -> None:
    """The loader takes what esptool makes of the ELF file, and refuses it for the other chip."""
    pytest.importorskip("esptool")
    name = {Chip.ESP32: "esp32", Chip.ESP32S3: "esp32s3"}[program.kind]
    image = tmp_path / "program.bin"
    command = [sys.executable, "-m", "esptool", "--chip", name, "elf2image", "--flash-mode", "dio", "-o", str(image)]
    subprocess.run([*command, str(program.path)], check=True, capture_output=True)
    with VirtualChip(program.kind) as by_image, VirtualChip(program.kind) as by_elf:
        by_image.load(image.read_bytes())
        by_elf.load(program.path.read_bytes())
        assert by_image.cpu().pc == by_elf.cpu().pc
        for place, size in segments(program.path.read_bytes()):
            assert by_image.read(place, size) == by_elf.read(place, size)
    (other,) = set(Chip) - {program.kind}
    with VirtualChip(other) as chip, pytest.raises(ChipFault, match="this image is for the ESP32"):
        chip.load(image.read_bytes())


def test_the_step_interrupt_has_a_budget(program: Built) -> None:
    """At the board's highest rate the interrupt must be done before the next event."""
    _, running = chip_run(program, LINES["fast"], 1000, timed=True)
    assert running.step_interrupt.count > 1000
    assert running.step_interrupt.cycles / running.step_interrupt.count < CPU_HZ / running.board.timing.max_step_rate_hz
