"""Our core and the step engine of the ESP32 on the virtual chip, alone: emulators/tests/espsim/bare."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc_chips.esp32.chip import CPU_HZ, SHIFT_FIRST, Chip, Cpu, Level, VirtualChip
from xtensa.toolchain import Toolchain

from xtensa_programs import bare
from xtensa_programs import code as c

ROOT = Path(__file__).resolve().parents[2]
BARE = ROOT / "emulators" / "tests" / "espsim" / "bare"
BOARDS = {Chip.ESP32: "esp32-wroom32", Chip.ESP32S3: "esp32s3-devkitc"}
REAL = (
    *("targets/chip/gang.c", "targets/chip/step_pins.c", "targets/esp32/hal/step_engine.c"),
    *("targets/esp32/hal/step_interrupt.c", "targets/esp32/hal/step_vector.S", "targets/esp32/app/board.c"),
    *("targets/esp32/app/wired.c", "targets/esp32/io/pin_map.c"),
    "targets/pic32mz/libc/math.c",  # in place of newlib's
)
SHIFTED = ("targets/esp32/hal/step_shift.c", "targets/esp32/hal/shift_i2s.c")
LEVEL5_VECTOR, USER_VECTOR, START = 0x240, 0x340, 0x380
STACK_BASE = 64
STACK_PAINT = b"\xa5"
PS_UM, PS_WOE = 0x20, 0x40000
SAME_EVENT = 100  # cycles in which edges belong to one step event
CCOMPARE0 = 240


def build(tools: Toolchain, chip: Chip, board: Board | None = None) -> Path:
    """The program. Raises RuntimeError. @param board  None: that of BOARDS"""
    real = REAL if board is None or board.step.engine != "i2s" else (*REAL, *SHIFTED)
    sources = [*sorted((ROOT / "core").rglob("*.c")), *(ROOT / name for name in real)]
    name = bare.PLACES[chip].name
    output = ROOT / "build" / "espsim" / (name if board is None else f"{name}-{board.id}")
    return bare.build(tools, ROOT, chip, sources, sorted(BARE.glob("*.c")), output, board)


def timer_handler() -> bytes:
    """Level 1 is the processor's timer, which ends a wait: its next match is 2^32 cycles away. Any exception ends in an
    instruction that does not exist."""
    code = c.wsr(0, c.EXCSAVE1) + c.rsr(0, c.EXCCAUSE)
    code += c.immediate(6, 2, 0, 4, 1)  # beqi a0, 4: past the next two bytes
    code += b"\x0e\0"
    return code + c.rsr(0, c.CCOUNT) + c.wsr(0, CCOMPARE0) + c.rsr(0, c.EXCSAVE1) + c.RFE


class Program:
    """A chip that runs a job."""

    def __init__(
        self,
        chip: VirtualChip,
        kind: Chip,
        program: Path,
        job: str,
        period_us: int,
        *,
        board: str | None = None,
        two_cores: bool = False,
        image: bytes | None = None,
        flash_period_us: int = 0,
        flash_erases: bool = False,
    ) -> None:
        """@param image  the program as an image, which lies in the flash chip
        @param flash_period_us  core 0 writes a page of flash as often, or erases a sector; 0: never"""
        self.chip, self.board = chip, load_board(board or BOARDS[kind])
        vectors = bare.PLACES[kind].vectors
        self.step_interrupt = Level()  # after run()
        self.misses = 0  # of the core of the steps, likewise
        self._stack_end = stack_end = self._load(program, image)
        self._painted = 0  # bytes below it
        self._wire()
        chip.write(vectors, c.window_vectors())
        step_vector = c.wsr(0, c.EXCSAVE1 + 4)
        step_vector += c.call0(vectors + LEVEL5_VECTOR + 3, chip.symbol("xt_highint5"))
        chip.write(vectors + LEVEL5_VECTOR, step_vector)
        chip.write(vectors + USER_VECTOR, timer_handler())
        loaded = chip.cpu()
        chip.write(vectors + START, c.wide(0, 14, 8))  # callx8 a8
        cpu = Cpu(pc=vectors + START, ps=PS_UM | PS_WOE, vecbase=vectors, cpenable=1, windowstart=1)
        cpu.a[1], cpu.a[8] = stack_end - STACK_BASE, loaded.pc
        chip.write(cpu.a[1] - 12, int(stack_end).to_bytes(4, "little"))  # the caller's stack: where its window goes
        chip.set_cpu(cpu)
        words = {"job_size": len(job), "period_us": period_us, "two_cores": two_cores}
        for name, value in (words | {"flash_period_us": flash_period_us, "flash_erases": flash_erases}).items():
            self._put(name, value)
        chip.write(chip.symbol("job"), job.encode())
        chip.record_edges()

    def _load(self, program: Path, image: bytes | None) -> int:
        """@return the stack's end"""
        self.chip.load(program.read_bytes())
        end = self.chip.cpu().a[1]
        if image is not None:
            self.chip.load(image)
            self.chip.load_symbols(program.read_bytes())
        return int(end)

    def _wire(self) -> None:
        """Shift registers, when the board has them."""
        if self.board.i2so is not None:
            pins = (self.board.i2so.bck, self.board.i2so.data, self.board.i2so.ws)
            clock, data, latch = (int(pin.pin.removeprefix("GPIO")) for pin in pins)
            self.chip.wire_shift_registers(clock, data, latch)

    def _put(self, name: str, value: int) -> None:
        self.chip.write(self.chip.symbol(name), value.to_bytes(4, "little"))

    def number(self, name: str) -> int:
        """A word of the program."""
        return int.from_bytes(self.chip.read(self.chip.symbol(name), 4), "little")

    def run(self, seconds: float) -> None:
        """Until the job is done. Raises TimeoutError after so much of the chip's time."""
        for _ in range(round(seconds / 0.05)):
            self._work(CPU_HZ // 20)
            if self.number("done"):
                self.step_interrupt = self.chip.interrupts(5)
                self.misses = self.chip.core(self.number("two_cores")).misses
                return
        raise TimeoutError(self.answers())

    def paint_stack(self, size: int) -> None:
        """Before run(): so many bytes that stack_used() looks at."""
        self._painted = size
        self.chip.write(self._stack_end - size, STACK_PAINT * (size - 2 * STACK_BASE))

    def stack_used(self) -> int:
        """Bytes from its end to the lowest that was written since paint_stack()."""
        left = self.chip.read(self._stack_end - self._painted, self._painted)
        return len(left.lstrip(STACK_PAINT))

    def _work(self, cycles: int) -> None:
        self.chip.run(cycles)

    def answers(self) -> str:
        return self.chip.read(self.chip.symbol("answers"), self.number("answers_size")).decode()

    def steps(self) -> NDArray[np.int64]:
        """(cycle of the first edge, step mask, direction mask) of each step event."""
        return step_events(self.chip.edges(), self.board)


def pins_of(board: Board, kind: str) -> list[int]:
    """Numbers by axis: GPIO pins, or outputs of shift registers."""
    names = board.pin_names()
    return [_number(names[f"{kind}_{axis.lower()}"]) for axis in board.axes]


def _number(pin: str) -> int:
    return SHIFT_FIRST + int(pin.removeprefix("I2SO.")) if pin.startswith("I2SO.") else int(pin.removeprefix("GPIO"))


def step_events(edges: list[tuple[int, int, int]], board: Board) -> NDArray[np.int64]:
    axis_of = {pin: axis for axis, pin in enumerate(pins_of(board, "step"))}
    direction_of = {pin: axis for axis, pin in enumerate(pins_of(board, "dir"))}
    found: list[list[int]] = []
    directions = 0
    for cycle, pin, level in edges:
        if pin in direction_of:
            bit = 1 << direction_of[pin]
            directions = directions | bit if level else directions & ~bit
        elif level and pin in axis_of:
            bit = 1 << axis_of[pin]
            if not found or cycle - found[-1][0] > SAME_EVENT or found[-1][1] & bit:
                found.append([cycle, 0, 0])
            found[-1][1] |= bit
            found[-1][2] |= directions & bit
    return np.array(found, dtype=np.int64).reshape(-1, 3)
