"""The processor by hand: windows, exceptions, interrupts, loops, timers, and what random instructions leave out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from wificnc_chips.esp32.chip import Chip, Cpu, Stop, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

# code, vectors, data
PLACES = {Chip.ESP32: (0x40090000, 0x40080000, 0x3FFC0000), Chip.ESP32S3: (0x40380000, 0x40378000, 0x3FCB0000)}
EXCM, UM, WOE = 0x10, 0x20, 0x40000
STACK = 0x8000  # from the begin of data
KERNEL, USER, DOUBLE = 0x300, 0x340, 0x3C0
LEVEL_VECTOR = {2: 0x180, 3: 0x1C0, 4: 0x200, 5: 0x240}


class Bench:
    """A chip with code, window handlers and a stack."""

    def __init__(self, chip: VirtualChip, kind: Chip) -> None:
        self.chip = chip
        self.code, self.vectors, self.data = PLACES[kind]
        chip.write(self.vectors, c.window_vectors())

    def begin(self, code: bytes, ps: int = UM, **registers: int) -> None:
        """@param registers  a2=5"""
        self.chip.write(self.code, code)
        self.chip.write(self.data + STACK - 12, (self.data + STACK + 64).to_bytes(4, "little"))  # a caller's stack
        cpu = Cpu(pc=self.code, ps=ps, vecbase=self.vectors, windowstart=1, cpenable=1)
        cpu.a[1] = self.data + STACK
        for name, value in registers.items():
            if name[0] == "a" and name[1:].isdigit():
                cpu.a[int(name[1:])] = value & 0xFFFFFFFF
            else:
                setattr(cpu, name, value)
        self.chip.set_cpu(cpu)

    def run(self, code: bytes, ps: int = UM, **registers: int) -> Cpu:
        """Until the end of the code."""
        self.begin(code, ps, **registers)
        self.chip.stop_at(self.code + len(code))
        assert self.chip.run(100_000) == Stop.PLACE
        return self.chip.cpu()

    def step(self, code: bytes, count: int = 1, ps: int = UM, **registers: int) -> Cpu:
        self.begin(code, ps, **registers)
        self.chip.run(count)
        return self.chip.cpu()


@pytest.fixture
def bench(chip: VirtualChip, request: pytest.FixtureRequest) -> Bench:
    return Bench(chip, request.node.callspec.params["chip"])


# ---- windows ----


@pytest.mark.parametrize("n", [4, 8, 12])
@pytest.mark.parametrize("depth", [0, 3, 7, 100])
def test_recursion_through_windows(bench: Bench, n: int, depth: int) -> None:
    """sum(n) = n + sum(n - 1), each call with a window of its own: far more than there are registers."""
    body = c.entry(1, 64) + c.addi(3, 2, 0)
    branch_at = 4 + len(body)
    tail = c.addi(n + 2, 2, -1)
    call_at = branch_at + 3 + len(tail)
    rest = tail + c.call(n, bench.code + call_at, bench.code + 4) + c.add(2, n + 2, 3)
    # beqz a2 over the rest
    skip = (6 | 1 << 4 | 2 << 8 | (len(rest) + 3 - 4) << 12).to_bytes(3, "little")
    function = body + skip + rest + c.RETW
    start = (len(function) + 4 + 3) & ~3
    main = c.call(8, bench.code + start, bench.code + 4)
    code = (b"\0" * 4 + function).ljust(start, b"\0") + main
    cpu = bench.run(code, ps=UM | WOE, pc=bench.code + start, a10=depth, a5=0x1234)
    assert cpu.a[10] == depth * (depth + 1) // 2
    assert (cpu.a[5], cpu.a[1]) == (0x1234, bench.data + STACK)
    assert (cpu.windowbase, cpu.windowstart, cpu.ps & EXCM) == (0, 1, 0)


def test_entry_and_retw_turn_the_window(bench: Bench) -> None:
    code = c.call(8, bench.code, bench.code + 8).ljust(8, b"\0") + c.entry(1, 48) + c.RETW
    inside = bench.step(code, count=2, ps=UM | WOE, a10=77)
    assert (inside.windowbase, inside.windowstart) == (2, 0b101)
    assert inside.a[2] == 77
    assert inside.a[1] == bench.data + STACK - 48
    assert inside.a[0] == 2 << 30 | (bench.code + 3) & 0x3FFFFFFF


def test_overflow_stores_the_oldest_window(bench: Bench) -> None:
    """A window that begins where registers are needed goes to the stack of its callee, as the ABI says."""
    stack = bench.data + 0x100
    bench.begin(c.addi(5, 5, 1), ps=UM | WOE, windowstart=0b111, a9=stack)
    before = bench.chip.cpu()
    bench.chip.run(1)
    handler = bench.chip.cpu()
    assert (handler.pc, handler.epc1) == (bench.vectors, bench.code)
    assert (handler.windowbase, handler.ps & EXCM, handler.ps >> 8 & 15) == (1, EXCM, 0)
    assert handler.a[0] == before.a[4]
    bench.chip.run(5)
    assert bench.chip.read(stack - 16, 16) == bytes(handler)[:16]
    after = bench.chip.cpu()
    assert (after.pc, after.windowbase, after.windowstart, after.ps) == (bench.code, 0, 0b101, UM | WOE)


def test_underflow_loads_the_caller(bench: Bench) -> None:
    """retw to a window that is on the stack: the handler of its size, in the caller's window, then retw again."""
    stack = bench.data + 0x200
    bench.chip.write(stack - 16, b"".join(value.to_bytes(4, "little") for value in (11, stack, 22, 33)))
    target = bench.code + 16
    code = c.RETW.ljust(16, b"\0") + c.NOP
    cpu = bench.run(code, ps=UM | WOE, windowbase=1, windowstart=0b10, a0=1 << 30 | target & 0x3FFFFFFF, a1=stack)
    assert (cpu.windowbase, cpu.windowstart) == (0, 1)
    assert list(cpu.a[:4]) == [11, stack, 22, 33]


def test_retw_without_a_call_is_illegal(bench: Bench) -> None:
    cpu = bench.step(c.RETW, ps=UM | WOE, a0=0x1000)
    assert (cpu.pc, cpu.exccause, cpu.epc1) == (bench.vectors + USER, 0, bench.code)


def test_movsp_with_the_caller_on_the_stack(bench: Bench) -> None:
    movsp = c.wide(0, 1, 5, 1)
    assert bench.step(movsp, ps=UM | WOE, a5=9).exccause == 5
    assert bench.step(movsp, ps=UM | WOE, windowbase=2, windowstart=0b101, a5=9).a[1] == 9


# ---- exceptions ----


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        (c.wide(0), 0),  # ill
        (c.wide(0, 0, 0, 5), 1),  # syscall
        (c.wide(0, 3, 2, 4, 2, 12), 6),  # quou a4, a2, a3 by 0
        (c.immediate(2, 3, 5, 14, 0), 9),  # s32c1i at an odd address
        (c.lsi(0, 1, 0), 32),  # without the FPU
    ],
)
def test_exceptions(bench: Bench, code: bytes, cause: int) -> None:
    """EPC1 is the instruction, EXCCAUSE is why, PS.UM chooses the vector."""
    for ps, vector in ((UM, USER), (0, KERNEL)):
        cpu = bench.step(code, ps=ps, a5=bench.data + 1, cpenable=0)
        assert (cpu.pc, cpu.epc1, cpu.exccause) == (bench.vectors + vector, bench.code, cause)
        assert cpu.ps & EXCM


def test_double_exception(bench: Bench) -> None:
    """In an exception: DEPC, and EPC1 stays."""
    cpu = bench.step(c.wide(0, 0, 0, 5), ps=UM | EXCM, epc1=99)
    assert (cpu.pc, cpu.epc1, cpu.exccause) == (bench.vectors + DOUBLE, 99, 1)
    after = bench.run(c.rsr(2, 192), ps=UM | EXCM)
    assert after.a[2] == bench.code


def test_bytes_of_instruction_ram_are_an_exception(bench: Bench) -> None:
    """Instruction RAM is read and written by aligned words only."""
    l8ui = c.immediate(2, 3, 2, 0, 0)
    cpu = bench.step(l8ui, a2=bench.vectors + 0x800)
    assert (cpu.exccause, cpu.excvaddr, cpu.pc) == (3, bench.vectors + 0x800, bench.vectors + USER)
    assert bench.run(c.l32i(3, 2, 0), a2=bench.vectors).a[3] == int.from_bytes(c.window_vectors()[:4], "little")


def test_code_that_is_stored_is_executed(bench: Bench) -> None:
    """After it was executed as something else."""
    word = int.from_bytes(c.addi(2, 2, 2), "little")
    bench.chip.write(bench.code + 64, c.addi(2, 2, 1) + c.RET)
    assert bench.run(c.call0(bench.code, bench.code + 64), a2=0).a[2] == 1
    ret_low = c.RET[0]
    value = word | ret_low << 24
    code = c.s32i(3, 4, 0) + c.NOP
    code += c.call0(bench.code + len(code), bench.code + 64)
    assert bench.run(code, a2=0, a3=value, a4=bench.code + 64).a[2] == 2


# ---- interrupts ----

TIMER0, SOFTWARE1, SOFTWARE3, TIMER2 = 1 << 6, 1 << 7, 1 << 29, 1 << 16
INTSET, INTCLEAR, CCOMPARE0 = 226, 227, 240


def test_software_interrupts(bench: Bench) -> None:
    """Level 1 is an exception with cause 4, level 3 has its vector, EPC and EPS."""
    code = c.wsr(2, INTSET) + c.NOP
    bench.chip.write(bench.vectors + USER, c.NOP * 2)
    cpu = bench.step(code, count=2, a2=SOFTWARE1, intenable=SOFTWARE1)
    assert (cpu.pc, cpu.exccause, cpu.epc1) == (bench.vectors + USER + 3, 4, bench.code + 3)
    bench.begin(code, a2=SOFTWARE3, intenable=SOFTWARE3)
    bench.chip.run(1)
    assert bench.chip.cpu().interrupt & SOFTWARE3
    bench.chip.write(bench.vectors + LEVEL_VECTOR[3], c.rsr(3, 179) + c.rsr(4, 195) + c.rsr(5, c.PS))
    bench.chip.run(3)
    cpu = bench.chip.cpu()
    assert (cpu.a[3], cpu.a[4], cpu.a[5]) == (bench.code + 3, UM, UM | EXCM | 3)


@pytest.mark.parametrize(
    ("interrupt", "ps", "taken"),
    [
        (SOFTWARE1, UM, True),
        (SOFTWARE1, UM | 1, False),
        (SOFTWARE1, UM | EXCM, False),
        (SOFTWARE3, UM | 2, True),
        (SOFTWARE3, UM | 3, False),
        (SOFTWARE3, UM | EXCM, False),  # EXCM holds off levels 1 to 3
    ],
)
def test_what_holds_interrupts_off(bench: Bench, interrupt: int, ps: int, taken: bool) -> None:
    bench.chip.write(bench.vectors + LEVEL_VECTOR[3], c.NOP + c.NOP)
    bench.chip.write(bench.vectors + USER, c.NOP + c.NOP)
    bench.step(c.wsr(2, INTSET) + c.NOP + c.NOP, count=2, ps=ps, a2=interrupt, intenable=interrupt)
    assert (bench.chip.cpu().pc < bench.vectors + 0x400) == taken


def test_level_5_comes_in_an_exception(bench: Bench) -> None:
    """The step interrupt's level is above what EXCM holds off; the timer matches at its cycle."""
    code = c.rsr(3, c.CCOUNT) + c.addi(3, 3, 20) + c.wsr(3, CCOMPARE0 + 2) + c.NOP * 40
    bench.chip.write(bench.vectors + LEVEL_VECTOR[5], c.rsr(4, c.CCOUNT) + c.NOP * 8)
    bench.begin(code, ps=UM | EXCM, intenable=TIMER2)
    bench.chip.run(30)
    cpu = bench.chip.cpu()
    assert cpu.a[4] - cpu.a[3] == 1  # the first instruction of the vector, one cycle after the match
    assert cpu.interrupt & TIMER2
    measured = bench.chip.interrupts(5)
    assert measured.count == 0  # it has not returned


def test_waiti_waits(bench: Bench) -> None:
    code = c.rsr(3, c.CCOUNT) + c.addmi(3, 3, 10240) + c.wsr(3, CCOMPARE0) + c.wide(0, 0, 0, 7) + c.NOP
    bench.chip.write(bench.vectors + USER, c.rsr(4, c.CCOUNT) + c.NOP * 3)
    bench.begin(code, intenable=TIMER0)
    before = bench.chip.instructions
    bench.chip.run(10_300)
    cpu = bench.chip.cpu()
    assert cpu.a[4] - cpu.a[3] in (1, 2)
    assert bench.chip.instructions - before < 200


def test_rfi_restores(bench: Bench) -> None:
    bench.chip.write(bench.vectors + LEVEL_VECTOR[3], c.wsr(2, INTCLEAR) + c.wide(0, 1, 3, 3))  # rfi 3
    cpu = bench.run(c.wsr(2, INTSET) + c.NOP + c.movi(5, 7), a2=SOFTWARE3, intenable=SOFTWARE3)
    assert (cpu.a[5], cpu.ps) == (7, UM)
    assert bench.chip.interrupts(3).count == 1


# ---- loops ----


def loop(kind: int, s: int, size: int) -> bytes:
    """loop, loopnez, loopgtz. @param size  of the body"""
    return c.immediate(6, 7, s, 8 + kind, size - 1)


@pytest.mark.parametrize(
    ("kind", "count", "times"), [(0, 1, 1), (0, 9, 9), (1, 0, 0), (1, 3, 3), (2, -4, 0), (2, 5, 5)]
)
def test_loops(bench: Bench, kind: int, count: int, times: int) -> None:
    body = c.addi(3, 3, 1)
    cpu = bench.run(loop(kind, 2, len(body)) + body, a2=count)
    assert cpu.a[3] == times


def test_a_loop_does_not_loop_in_an_exception(bench: Bench) -> None:
    body = c.addi(3, 3, 1)
    assert bench.run(loop(0, 2, len(body)) + body, ps=UM | EXCM, a2=5).a[3] == 1


def test_a_branch_out_of_a_loop(bench: Bench) -> None:
    """Leaves LCOUNT as it is."""
    body = c.addi(3, 3, 1) + c.jump(6) + c.NOP
    cpu = bench.run(loop(0, 2, len(body)) + body + c.NOP, a2=5)
    assert (cpu.a[3], cpu.lcount) == (1, 4)


# ---- instructions without vectors ----

WORDS = (0, 1, 5, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x12345678, 0xFFFF0000)


def signed(value: int) -> int:
    return value - (1 << 32) if value >> 31 else value


def test_high_products(bench: Bench) -> None:
    for x in WORDS:
        for y in WORDS:
            code = c.wide(0, 3, 2, 4, 2, 10) + c.wide(0, 3, 2, 5, 2, 11)  # muluh, mulsh
            cpu = bench.run(code, a2=x, a3=y)
            assert cpu.a[4] == x * y >> 32
            assert cpu.a[5] == signed(x) * signed(y) >> 32 & 0xFFFFFFFF


def test_booleans(bench: Bench) -> None:
    formulas = {
        0: lambda s, t: s & t,
        1: lambda s, t: s & (1 - t),
        2: lambda s, t: s | t,
        3: lambda s, t: s | (1 - t),
        4: lambda s, t: s ^ t,
    }
    for op2, formula in formulas.items():
        for br in range(8):
            s, t = br >> 1 & 1, br >> 2 & 1
            wanted = br & ~1 | formula(s, t)
            assert bench.run(c.wide(0, 2, 1, 0, 2, op2), br=br).br == wanted


def test_any_and_all(bench: Bench) -> None:
    for bits in range(16):
        for kind, wanted in ((8, bits != 0), (9, bits == 15)):
            assert bench.run(c.wide(0, 0, 4, kind), br=bits << 4).br & 1 == wanted
    for bits in (0, 1, 0x80, 0xFE, 0xFF):
        for kind, wanted in ((10, bits != 0), (11, bits == 255)):
            assert bench.run(c.wide(0, 0, 8, kind), br=bits << 8).br & 1 == wanted


def test_shifts_by_32(bench: Bench) -> None:
    """SAR has six bits."""
    srl, sra, sll = c.wide(0, 3, 0, 4, 1, 9), c.wide(0, 3, 0, 5, 1, 11), c.wide(0, 0, 3, 6, 1, 10)
    cpu = bench.run(srl + sra, a3=0x87654321, sar=32)
    assert (cpu.a[4], cpu.a[5]) == (0, 0xFFFFFFFF)
    assert bench.run(sll, a3=0x87654321, sar=0).a[6] == 0


def test_compare_and_swap(bench: Bench) -> None:
    swap = c.immediate(2, 3, 2, 14, 0)
    for held, stored in ((5, 9), (6, 5)):
        bench.chip.write(bench.data, (5).to_bytes(4, "little"))
        cpu = bench.run(swap, a2=bench.data, a3=9, scompare1=held)
        assert cpu.a[3] == 5 and bench.chip.read(bench.data, 1)[0] == stored


def test_words_at_odd_addresses(bench: Bench) -> None:
    """In data RAM they are read and written by hardware."""
    bench.chip.write(bench.data + 0xFFC, bytes(range(8)))
    cpu = bench.run(c.l32i(3, 2, 0) + c.s32i(3, 2, 8), a2=bench.data + 0xFFE)
    assert cpu.a[3] == 0x05040302 and bench.chip.read(bench.data + 0x1006, 4) == bytes((2, 3, 4, 5))


# ---- division and root: sequences of instructions, as libgcc has them ----

MADDN, DIVN = 6, 7
CONST, NEG, DIV0, SQRT0, NEXP01, MKSADJ, MKDADJ, ADDEXP, ADDEXPM, MOV = 3, 6, 7, 9, 11, 12, 13, 14, 15, 0


def unary(code: int, r: int, s: int) -> bytes:
    return c.wide(0, code, s, r, 10, 15)


def maddn(r: int, s: int, t: int) -> bytes:
    return c.wide(0, t, s, r, 10, MADDN)


def division() -> bytes:
    """f0 = f1 / f2"""
    code = unary(DIV0, 3, 2) + unary(NEXP01, 4, 2) + unary(CONST, 5, 1) + maddn(5, 4, 3) + unary(MOV, 6, 3)
    code += unary(MOV, 7, 2) + unary(NEXP01, 2, 1) + maddn(6, 5, 3) + unary(CONST, 5, 1) + unary(CONST, 0, 0)
    code += unary(NEG, 8, 2) + maddn(5, 4, 6) + maddn(0, 8, 3) + unary(MKDADJ, 7, 1) + maddn(6, 5, 6)
    code += maddn(8, 4, 0) + unary(CONST, 3, 1) + maddn(3, 4, 6) + maddn(0, 8, 6) + unary(NEG, 2, 2)
    code += maddn(6, 3, 6) + maddn(2, 4, 0) + unary(ADDEXPM, 0, 7) + unary(ADDEXP, 6, 7)
    return code + c.wide(0, 6, 2, 0, 10, DIVN)


def root() -> bytes:
    """f0 = sqrt(f1)"""
    code = unary(SQRT0, 2, 1) + unary(CONST, 3, 0) + maddn(3, 2, 2) + unary(NEXP01, 4, 1) + unary(CONST, 0, 3)
    code += unary(ADDEXP, 4, 0) + maddn(0, 3, 4) + unary(NEXP01, 3, 1) + unary(NEG, 5, 3) + maddn(2, 0, 2)
    code += unary(CONST, 0, 0) + maddn(0, 5, 2) + unary(NEG, 2, 6) + unary(MKSADJ, 2, 1) + unary(NEXP01, 1, 1)
    code += maddn(1, 0, 0) + unary(NEG, 3, 6) + unary(ADDEXPM, 0, 2) + unary(ADDEXP, 3, 2)
    return code + c.wide(0, 3, 1, 0, 10, DIVN)


FLOATS = (1.0, 3.0, -7.25, 1e-30, 3.4e38, 1e-40, 0.1, 123456.789, 0.0, -0.0, math.inf)


def bits(value: float) -> int:
    return int(np.float32(value).view(np.uint32))


@np.errstate(all="ignore")
def test_division_is_exactly_rounded(bench: Bench) -> None:
    for x in FLOATS:
        for y in FLOATS:
            bench.begin(division())
            cpu = bench.chip.cpu()
            cpu.f[1], cpu.f[2] = bits(x), bits(y)
            bench.chip.set_cpu(cpu)
            bench.chip.stop_at(bench.code + len(division()))
            assert bench.chip.run(100) == Stop.PLACE
            quotient = np.float32(x) / np.float32(y)
            wanted = 0x7FC00000 if np.isnan(quotient) else bits(quotient)
            assert bench.chip.cpu().f[0] == wanted, (x, y)


@np.errstate(all="ignore")
def test_a_root_is_exactly_rounded(bench: Bench) -> None:
    for x in FLOATS:
        bench.begin(root())
        cpu = bench.chip.cpu()
        cpu.f[1] = bits(x)
        bench.chip.set_cpu(cpu)
        bench.chip.stop_at(bench.code + len(root()))
        assert bench.chip.run(100) == Stop.PLACE
        wanted = 0x7FC00000 if x < 0 else bits(np.sqrt(np.float32(x)))
        assert bench.chip.cpu().f[0] == wanted, x


# ---- what stops the chip ----


def test_an_address_without_anything(bench: Bench) -> None:
    with pytest.raises(ChipFault, match="load from 70000000, where nothing is emulated, by the instruction at"):
        bench.step(c.l32i(3, 2, 0), a2=0x70000000)


def test_the_debuggers_registers_are_zero(bench: Bench) -> None:
    """RER of DSRSET, by which ESP-IDF finds out whether a debugger is there; WER does nothing."""
    assert bench.step(c.wide(0, 4, 3, 6, 0, 4), a3=0x10200C, a4=77).a[4] == 0
    bench.step(c.wide(0, 4, 3, 7, 0, 4), a3=0x10200C)


def test_an_unknown_instruction(bench: Bench) -> None:
    with pytest.raises(ChipFault, match=f"the instruction 00000e at {bench.code:08x} is not emulated"):
        bench.step(b"\x0e\0\0\0")


def test_data_ram_holds_no_code(bench: Bench) -> None:
    with pytest.raises(ChipFault, match=f"the program runs to {bench.data:08x}, where there is no code"):
        bench.step(c.wide(0, 10, 4), count=2, a4=bench.data)


def test_a_function_of_the_rom_that_is_not_there(bench: Bench) -> None:
    with pytest.raises(ChipFault, match="the boot ROM's function at 40001000"):
        bench.step(c.wide(0, 12, 4), count=2, a4=0x40001000)


# ---- stops ----


def test_a_stop_comes_each_time_and_changes_nothing(bench: Bench) -> None:
    """Of an instruction that was executed before, too."""
    body = c.addi(3, 3, 1) + c.addi(4, 4, 1)
    code = body + c.jump(-len(body))
    bench.begin(code)
    bench.chip.run(9)
    bench.chip.stop_at(bench.code + 3)
    for times in range(4, 8):
        assert bench.chip.run(100) == Stop.PLACE
        cpu = bench.chip.cpu()
        assert (cpu.pc, cpu.a[3], cpu.a[4]) == (bench.code + 3, times, times - 1)
