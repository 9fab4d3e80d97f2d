"""Our core and step engines on both cores of the virtual chip, as the firmware has them: the motion side and the step
interrupt on core 1, the task side on core 0. What leaves pins and shift registers is the PC's; flash that core 0
writes meanwhile stops core 1's task and the cache, and no step comes at another time.

With an image in the flash chip, code that lies in flash cannot be fetched while the cache is off: the chip would stop
and name it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import images
import numpy as np
import pytest
from chip_steps import assert_same_steps, assert_steps_in_time
from numpy.typing import NDArray
from slow import deep_but
from wificnc.board.load import load_board
from wificnc.simulator.run import SimOptions, simulate
from wificnc_chips.esp32.chip import SHIFT_FIRST, Chip, VirtualChip
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain
from xtensa_programs.program import Program, build

pytestmark = pytest.mark.slow  # compiles a program for the virtual chip

SETTINGS = tuple(f"${base + axis}={value}" for base, value in ((110, 5000), (120, 500)) for axis in range(4))
CYCLES_PER_TICK = 12  # of the step timer, 20 MHz
LATENCY_CYCLES = 2  # an instruction is done before the interrupt is taken
LINE_CYCLES = 912  # of the cache, from flash: docs/espsim.md
FRAME_CYCLES = 480  # of a word of I2S
NS_PER_CYCLE = 1000 / 240
FLASH = (0x3F400000, 0x40000000), (0x400C2000, 0x40400000)  # data, code
GPIO, I2S = "esp32-wroom32", "mks-tinybee"
DIAGONAL = "G91G1X10Y7Z3A1F2000\nX-10Y-7Z-3A-1"
LONG = "G91G1X20Y5F1500"
SPEED_WINDOW = 20  # events


@dataclass(frozen=True)
class Built:
    board: str
    path: Path

    @property
    def grid_cycles(self) -> int:
        """What an edge may be late by, as it waits for its word."""
        return FRAME_CYCLES if self.board == I2S else 0


# The board of the I2S takes half a minute to compile; tests/esp32 runs its shifter's steps at emulated registers.
@pytest.fixture(scope="module", params=deep_but(GPIO.__eq__, [GPIO, I2S]))
def program(request: pytest.FixtureRequest) -> Built:
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(tools):
        pytest.skip(said)
    board = None if request.param == GPIO else load_board(request.param)
    return Built(request.param, build(tools, Chip.ESP32, board))


def pc_trace(folder: Path, board: str, lines: str) -> NDArray[np.int64]:
    """(ns, step mask, direction mask) of the PC's simulation of the same board."""
    job, trace = folder / "job.nc", folder / "trace.csv"
    job.write_text(lines + "\n")
    simulate(SimOptions(file=job, board=board, settings=SETTINGS, trace=trace))
    return np.loadtxt(trace, delimiter=",", skiprows=1, dtype=np.int64, ndmin=2)


def image_of(elf: bytes) -> bytes:
    """As esptool makes one: segments of flash where a page can map them."""
    table, size, count = (*struct.unpack_from("<I", elf, 28), *struct.unpack_from("<HH", elf, 42))
    headers = [struct.unpack_from("<6I", elf, table + n * size) for n in range(count)]
    pieces: list[tuple[int, bytes]] = []
    for kind, at, address, _, in_file, _ in headers:
        if kind != 1 or in_file == 0:
            continue
        piece = (address, elf[at : at + in_file] + bytes(-in_file % 4))
        end = 24 + sum(8 + len(data) for _, data in pieces)
        in_flash = any(first <= address < last for first, last in FLASH)
        pieces += images.mapped(piece, end) if in_flash else [piece]
    return images.image(struct.unpack_from("<I", elf, 24)[0], pieces)


def run(
    program: Built, lines: str, *, flash_period_us: int = 0, flash_erases: bool = False, timed: bool = True
) -> Program:
    """On both cores, from flash; the task side every ms. @param timed  with the model of caches and pipeline"""
    chip = VirtualChip(Chip.ESP32)
    chip.timing(timed)
    running = Program(
        chip,
        Chip.ESP32,
        program.path,
        "\n".join((*SETTINGS, lines)) + "\n",
        1000,
        board=program.board,
        two_cores=True,
        image=image_of(program.path.read_bytes()),
        flash_period_us=flash_period_us,
        flash_erases=flash_erases,
    )
    running.run(30)
    assert running.answers().count("ok") == len(SETTINGS) + len(lines.split("\n"))
    assert "error" not in running.answers() and "ALARM" not in running.answers()
    return running


def same_events(pc: NDArray[np.int64], chip: NDArray[np.int64]) -> None:
    assert len(pc) == len(chip) > 0
    np.testing.assert_array_equal(chip[:, 1], pc[:, 1])
    np.testing.assert_array_equal(chip[:, 2] & chip[:, 1], pc[:, 2] & pc[:, 1])


def lateness_ns(pc: NDArray[np.int64], chip: NDArray[np.int64]) -> NDArray[np.float64]:
    """In whole sixths of a ns, 1/25 cycle, until the last step: some events are late by exactly the bound."""
    sixths = (chip[:, 0] - chip[0, 0]) * 25 - (pc[:, 0] - pc[0, 0]) * 6
    return (sixths - np.median(sixths)) / 6


def at_its_times(program: Built, pc: NDArray[np.int64], chip: NDArray[np.int64], timed: bool) -> None:
    """But where an instruction waits for a line of the cache, and that for one of the other core. Without the model
    nothing waits, and the events are within the bound around the middle of the earliest and the latest."""
    bound = (CYCLES_PER_TICK + LATENCY_CYCLES + program.grid_cycles / 2) * NS_PER_CYCLE
    if timed:
        assert_steps_in_time(pc, chip, NS_PER_CYCLE, bound + 2 * LINE_CYCLES * NS_PER_CYCLE)
        return
    same_events(pc, chip)
    assert np.ptp(lateness_ns(pc, chip)) <= 2 * bound


@pytest.mark.parametrize("timed", [True, False])
def test_both_cores_make_the_pcs_steps_at_its_times(program: Built, tmp_path: Path, timed: bool) -> None:
    """With I2S each within half a word of it, as a word begins each 2 us."""
    pc, running = pc_trace(tmp_path, program.board, DIAGONAL), run(program, DIAGONAL, timed=timed)
    with running.chip:
        at_its_times(program, pc, running.steps(), timed)


@pytest.mark.parametrize("timed", [True, False])
def test_flash_that_is_written_meanwhile_moves_no_step(program: Built, tmp_path: Path, timed: bool) -> None:
    """A page each 20 ms as the job runs: what was prepared lasts until core 1 works again."""
    pc, running = pc_trace(tmp_path, program.board, LONG), run(program, LONG, flash_period_us=20_000, timed=timed)
    with running.chip:
        assert running.number("flash_writes") >= 20
        at_its_times(program, pc, running.steps(), timed)


def test_no_step_is_lost_when_a_sector_is_erased(program: Built, tmp_path: Path) -> None:
    """Longer than what is prepared: motion brakes and continues, in the same steps."""
    pc = pc_trace(tmp_path, program.board, LONG)
    running = run(program, LONG, flash_period_us=200_000, flash_erases=True)
    with running.chip:
        assert running.number("flash_writes") >= 2
        chip = running.steps()
    assert_same_steps(pc, chip)
    at = SPEED_WINDOW
    pc_speed, speed = (np.diff(events[::at, 0]) * scale for events, scale in ((pc, 1.0), (chip, NS_PER_CYCLE)))
    assert (speed >= pc_speed.min() - 1000).all()  # never faster than the job's speed


def test_the_same_run_has_the_same_bits(program: Built) -> None:
    def edges() -> list[tuple[int, int, int]]:
        running = run(program, "G91G1X2Y1F1500", flash_period_us=100_000)
        with running.chip:
            return running.chip.edges()

    assert edges() == edges()


@pytest.mark.deep
@pytest.mark.parametrize("program", [I2S], indirect=True)  # tests/xtensa/test_on_chip.py has those of pins
def test_pulses_and_pauses_of_shift_registers(program: Built) -> None:
    """High and low at least the setting's pulse, in whole words; a direction is stable before a step."""
    running = run(program, "G91G0X20\nG1X-5F9000")
    with running.chip:
        edges = running.chip.edges()
    board = running.board
    step, direction = (SHIFT_FIRST + int(board.pin_names()[name].removeprefix("I2SO.")) for name in ("step_x", "dir_x"))
    cycles = [cycle for cycle, pin, _ in edges if pin == step]
    assert len(cycles) > 1000 and np.diff(cycles).min() * NS_PER_CYCLE >= board.timing.step_pulse_ns
    assert not (np.diff(cycles[1:]) % FRAME_CYCLES).any()  # the first was shifted by hand
    rises = np.array([cycle for cycle, pin, level in edges if pin == step and level])
    turns = [cycle for cycle, pin, _ in edges if pin == direction]
    assert turns
    for turn in turns:
        later = rises[rises > turn]
        assert len(later) == 0 or (later[0] - turn) * NS_PER_CYCLE >= board.timing.dir_setup_ns
