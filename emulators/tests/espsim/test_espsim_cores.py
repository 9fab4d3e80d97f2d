"""Two cores: the order of what they do, atomic instructions, interrupts between them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from wificnc_chips.esp32.chip import CPU_HZ, Chip, Cpu, VirtualChip
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain
from xtensa_programs import bare
from xtensa_programs import code as c

ROOT = Path(__file__).resolve().parents[3]
COUNTS = 3000  # of main.c
VECTOR, MISC0, EXCSAVE5 = 0x240, 244, c.EXCSAVE1 + 4
ASK = {Chip.ESP32: 0x3FF000E0, Chip.ESP32S3: 0x600C0034}
RFI5 = c.wide(0, 1, 5, 3)


@pytest.fixture(params=list(Chip), ids=["esp32", "esp32s3"])
def kind(request: pytest.FixtureRequest) -> Chip:
    return Chip(request.param)


@pytest.fixture
def program(kind: Chip) -> bytes:
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(tools):
        pytest.skip(said)
    output = ROOT / "build" / "espsim" / f"cores-{bare.PLACES[kind].name}"
    own = [Path(__file__).with_name("cores") / "main.c"]
    return bare.build(tools, ROOT, kind, [], own, output).read_bytes()


def handler(chip: VirtualChip, kind: Chip, at: int) -> bytes:
    """Clear the register that asks, count the interrupt."""
    words = [ASK[kind], chip.symbol("interrupts")]
    literals = [at + VECTOR - 4 * (n + 1) for n in range(len(words))]
    for literal, word in zip(literals, words, strict=True):
        chip.write(literal, word.to_bytes(4, "little"))
    code = b""

    def load(register: int, literal: int) -> bytes:
        return c.l32r(register, at + VECTOR + len(code), literal)

    code += c.wsr(2, EXCSAVE5) + c.wsr(3, MISC0)
    code += load(2, literals[0]) + c.movi(3, 0) + c.s32i(3, 2, 0)
    code += load(2, literals[1]) + c.l32i(3, 2, 0) + c.addi(3, 3, 1) + c.s32i(3, 2, 0)
    return code + c.rsr(2, EXCSAVE5) + c.rsr(3, MISC0) + RFI5


class Run:
    """The program, until it is done."""

    def __init__(self, kind: Chip, program: bytes) -> None:
        self.chip = VirtualChip(kind)
        vectors = bare.PLACES[kind].vectors
        self.chip.load(program)
        self.chip.write(vectors, c.window_vectors())
        self.chip.write(vectors + VECTOR, handler(self.chip, kind, vectors))
        self.chip.write(self.chip.symbol("vectors"), vectors.to_bytes(4, "little"))
        loaded = self.chip.cpu()
        cpu = Cpu(pc=loaded.pc, ps=0x40020, vecbase=vectors, windowstart=1)
        cpu.a[1] = loaded.a[1] - 64
        self.chip.set_cpu(cpu)
        for _ in range(100):
            self.chip.run(CPU_HZ // 1000)
            if self.number("done"):
                return
        raise TimeoutError

    def number(self, name: str, index: int = 0) -> int:
        return int.from_bytes(self.chip.read(self.chip.symbol(name) + 4 * index, 4), "little")

    def state(self) -> list[int]:
        cpus = [self.chip.cpu(core) for core in (0, 1)]
        return [self.chip.instructions, self.number("plain"), *(value for cpu in cpus for value in (cpu.pc, *cpu.a))]


@pytest.fixture
def run(kind: Chip, program: bytes) -> Iterator[Run]:
    run = Run(kind, program)
    with run.chip:
        yield run


def test_cores_have_their_numbers(run: Run) -> None:
    """What ESP-IDF reads in PRID."""
    assert (run.number("ids", 0), run.number("ids", 1)) == (0xCDCD, 0xABAB)


def test_no_atomic_addition_is_lost(run: Run) -> None:
    """And some that are not atomic are: the cores really take turns in the middle of it."""
    assert run.number("counter") == 2 * COUNTS
    assert COUNTS < run.number("plain") < 2 * COUNTS


def test_a_core_interrupts_the_other_one(run: Run) -> None:
    """Once, and not itself."""
    assert (run.number("interrupts"), run.number("woken")) == (1, 1)
    app, main = run.chip.cpu(1), run.chip.cpu(0)
    assert app.interrupt == 0 and main.interrupt == 0


def test_the_same_run_again_is_the_same(run: Run, kind: Chip, program: bytes) -> None:
    again = Run(kind, program)
    with again.chip:
        assert again.state() == run.state()
