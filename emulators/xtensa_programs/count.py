"""Instructions of motion on an ESP32's processor: each call of a function, in the virtual chip.

LLVM's code of the firmware's sources, one instruction a cycle; functions of the boot ROM as rom.def has them. A call
ends at the address to which it returns; the step interrupts that came within it are taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.load import load_board
from wificnc_chips.esp32.chip import Chip, Stop, VirtualChip
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain

from xtensa_programs.program import BOARDS, Program, build

# What others call of motion, and its half on the motion side.
PLANNER, EMISSION, SPANS = "motion_tool_line", "motion_poll", "prep_poll"
SECONDS = 300.0  # of the chip's time: more than the jobs take
STEP_LEVEL = 5
ADDRESS, REGION, CALLED = 0x3FFFFFFF, 0xC0000000, 16  # bits of an address; where PS has the size of the call


@dataclass
class Calls:
    """Of one function, with all that it calls."""

    count: int = 0
    instructions: int = 0
    longest: int = 0
    blocks: int = 0  # of the job
    steps: int = 0


@dataclass(frozen=True)
class Count:
    """What a job took."""

    blocks: int
    steps: int  # events with a step
    motion: int  # planner, emission, batches
    spans: int
    longest: dict[str, int]  # call of EMISSION and of SPANS


class Counted(Program):
    """Counts the calls of a function."""

    def __init__(self, chip: VirtualChip, kind: Chip, program: Path, job: str, function: str) -> None:
        chip.timing(False)  # instructions are counted
        super().__init__(chip, kind, program, job, 1000)
        self.calls = Calls()
        self._entry = chip.symbol(function)
        self._began: int | None = None
        chip.stop_at(self._entry)

    def _work(self, cycles: int) -> None:
        until = self.chip.cycles + cycles
        while self.chip.run_until(until) == Stop.PLACE:
            self._begin() if self._began is None else self._end(self._began)

    def _own(self) -> int:
        """Instructions, but for those of the step interrupt."""
        return self.chip.cycles - int(self.chip.interrupts(STEP_LEVEL).cycles)

    def _begin(self) -> None:
        cpu = self.chip.cpu()
        returns = cpu.a[4 * (cpu.ps >> CALLED & 3)]
        self._began = self._own()
        self.chip.stop_at(returns & ADDRESS | cpu.pc & REGION)

    def _end(self, began: int) -> None:
        took = self._own() - began
        self.calls.count += 1
        self.calls.instructions += took
        self.calls.longest = max(self.calls.longest, took)
        self._began = None
        self.chip.stop_at(self._entry)


def not_here() -> str:
    """What to install; "" when all is here."""
    try:
        return windows.missing(find_toolchain())
    except NoToolchainError as err:
        return str(err)


def count_job(kind: Chip, job: Path, settings: Sequence[str]) -> Count:
    """Run a job, once for each function. Raises RuntimeError when it has errors."""
    program = build(find_toolchain(), kind)
    axes = len(load_board(BOARDS[kind]).axes)
    lines = [line for line in settings if _axis(line) < axes]
    text = "\n".join((*lines, job.read_text()))
    calls = {name: _calls(kind, program, text, name) for name in (PLANNER, EMISSION, SPANS)}
    return Count(
        blocks=calls[SPANS].blocks,
        steps=calls[SPANS].steps,
        motion=calls[PLANNER].instructions + calls[EMISSION].instructions,
        spans=calls[SPANS].instructions,
        longest={name: calls[name].longest for name in (EMISSION, SPANS)},
    )


def _axis(setting: str) -> int:
    """$100 to $132 are of an axis; -1: another setting"""
    number = int(setting.removeprefix("$").partition("=")[0])
    return number % 10 if 100 <= number < 140 else -1


def _calls(kind: Chip, program: Path, job: str, function: str) -> Calls:
    with VirtualChip(kind) as chip:
        running = Counted(chip, kind, program, job, function)
        running.run(SECONDS)
        if "error" in running.answers():
            raise RuntimeError(running.answers())
        running.calls.blocks, running.calls.steps = running.number("blocks"), len(running.steps())
        return running.calls
