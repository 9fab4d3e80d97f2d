"""What instructions cost on the virtual chip: pipeline, caches of flash, registers. Each program's misses and cycles
are known from how it is made."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from wificnc_chips.esp32.chip import Chip, Cpu, Stop, VirtualChip
from wificnc_chips.fault import ChipFault
from xtensa_programs import code as c

RAM = {Chip.ESP32: 0x40090000, Chip.ESP32S3: 0x40380000}
DATA = {Chip.ESP32: 0x3FFC0000, Chip.ESP32S3: 0x3FCB0000}
FLASH = {Chip.ESP32: 0x400D0000, Chip.ESP32S3: 0x42000000}
FLASH_DATA = {Chip.ESP32: 0x3F400000, Chip.ESP32S3: 0x3C000000}
WAYS = {Chip.ESP32: 2, Chip.ESP32S3: 8}
WAY = {Chip.ESP32: 0x4000, Chip.ESP32S3: 0x800}  # bytes: 32 KB in two ways, 16 KB in eight
LINE, MISS = 32, {Chip.ESP32: (8 + 12 + 4 + 128) * 6, Chip.ESP32S3: (8 + 12 + 4 + 128) * 3}  # DIO, 40 and 80 MHz
SPI0 = {Chip.ESP32: 0x3FF43000, Chip.ESP32S3: 0x60003000}
GPIO_OUT = {Chip.ESP32: 0x3FF44004, Chip.ESP32S3: 0x60004004}
TAKEN, BUS = 2, 12
MEMW = c.wide(0, 12, 0, 2)


class Bench:
    def __init__(self, chip: VirtualChip, kind: Chip) -> None:
        self.chip, self.kind = chip, kind
        self.line_cycles = MISS[kind]

    def run(self, at: int, code: bytes, end: int | None = None, **registers: int) -> tuple[int, int, int]:
        """From `at` to `end`, or the end of the code. @return cycles, instructions, misses"""
        if code:
            self.chip.write(at, code)
        cpu = Cpu(pc=at, ps=0x20, vecbase=0x40000000, windowstart=1, cpenable=1)
        for name, value in registers.items():
            cpu.a[int(name[1:])] = value
        self.chip.set_cpu(cpu)
        self.chip.stop_at(at + len(code) if end is None else end)
        before, from_cycle = self.chip.core(0), self.chip.cycles
        assert self.chip.run(10_000_000) == Stop.PLACE
        after = self.chip.core(0)
        assert after.missing - before.missing == (after.misses - before.misses) * self.line_cycles
        return (
            self.chip.cycles - from_cycle,
            after.instructions - before.instructions,
            after.misses - before.misses,
        )

    def call_rom(self, address: dict[Chip, int], *arguments: int) -> None:
        """A function of the boot ROM."""
        at = RAM[self.kind] + 0x2000
        code = c.wide(0, 12, 8)  # callx0 a8
        registers = {f"a{2 + n}": value for n, value in enumerate(arguments)}
        self.run(at, code, a8=address[self.kind], **registers)


@pytest.fixture(params=list(Chip), ids=["esp32", "esp32s3"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with VirtualChip(request.param) as chip:
        yield Bench(chip, request.param)


# ---- caches ----


def test_code_in_flash_misses_once_a_line(bench: Bench) -> None:
    """63 instructions of 3 bytes begin in six lines; the second time all are there."""
    at, code = FLASH[bench.kind], c.NOP * 63
    assert bench.run(at, code) == (63 + 6 * MISS[bench.kind], 63, 6)
    assert bench.run(at, b"", at + len(code)) == (63, 63, 0)


def test_code_in_ram_misses_nothing(bench: Bench) -> None:
    assert bench.run(RAM[bench.kind], c.NOP * 63) == (63, 63, 0)


def chain(bench: Bench, places: int) -> None:
    """Jumps through so many lines of one set, back to the first place, and off after the second round."""
    at, way = FLASH[bench.kind], WAY[bench.kind]
    for n in range(places):
        to = at + way * ((n + 1) % places)
        bench.chip.write(at + way * n, c.jump(to - at - way * n))


@pytest.mark.parametrize("more", [0, 1])
def test_a_set_has_so_many_lines_as_ways(bench: Bench, more: int) -> None:
    """As many places of a set as there are ways: one miss each. One more, and each of them misses in each round."""
    places = WAYS[bench.kind] + more
    chain(bench, places)
    rounds = 10
    cpu = Cpu(pc=FLASH[bench.kind], ps=0x20, windowstart=1)
    bench.chip.set_cpu(cpu)
    begin = bench.chip.core(0)
    while bench.chip.core(0).instructions - begin.instructions < rounds * places:
        bench.chip.run(1)
    misses = bench.chip.core(0).misses - begin.misses
    assert misses == (rounds * places if more else places)


def test_constants_in_flash_miss_once_a_line(bench: Bench) -> None:
    """Sixteen words are two lines; a byte and a half word of them are there, then."""
    code = b"".join(c.l32i(3, 2, 4 * n) for n in range(16)) + c.immediate(2, 3, 2, 0, 5) + c.immediate(2, 3, 2, 1, 9)
    bench.chip.write(FLASH_DATA[bench.kind], bytes(range(64)))
    assert bench.run(RAM[bench.kind], code, a2=FLASH_DATA[bench.kind])[2] == 2
    assert bench.chip.cpu().a[3] == 18 | 19 << 8
    assert bench.run(RAM[bench.kind], b"", RAM[bench.kind] + len(code), a2=FLASH_DATA[bench.kind])[2] == 0


def test_the_esp32_has_one_cache_for_code_and_constants_the_s3_two(bench: Bench) -> None:
    """A line of code stays, unless constants of its set fill all ways."""
    at, data, way = FLASH[bench.kind], FLASH_DATA[bench.kind], WAY[bench.kind]
    assert bench.run(at, c.NOP)[2] == 1
    loads = c.l32i(3, 2, 0) + c.add(2, 2, 4)
    ways = 8
    bench.run(RAM[bench.kind], loads * ways, a2=data, a4=0x4000 if bench.kind == Chip.ESP32 else way)
    assert bench.run(at, b"", at + 3)[2] == (1 if bench.kind == Chip.ESP32 else 0)


FLUSH = {Chip.ESP32: 0x40009A14, Chip.ESP32S3: 0x400016D4}
INVALIDATE_ADDRESS = {Chip.ESP32S3: 0x400016B0}
CONFIGURE_CODE, CONFIGURE_DATA = {Chip.ESP32S3: 0x40001A1C}, {Chip.ESP32S3: 0x40001A28}


def test_the_boot_rom_flushes(bench: Bench) -> None:
    """Cache_Flush_rom of core 0; Cache_Invalidate_ICache_All. The other core's flush changes nothing."""
    at, code = FLASH[bench.kind], c.NOP * 63
    bench.run(at, code)
    bench.call_rom(FLUSH, 0)
    assert bench.run(at, b"", at + len(code))[2] == 6
    if bench.kind == Chip.ESP32:
        bench.call_rom(FLUSH, 1)
        assert bench.run(at, b"", at + len(code))[2] == 0


def test_the_flush_bit_of_the_esp32(bench: Bench) -> None:
    if bench.kind != Chip.ESP32:
        return
    at, code = FLASH[bench.kind], c.NOP * 63
    bench.run(at, code)
    bench.run(RAM[bench.kind], c.s32i(3, 2, 0), a2=0x3FF00040, a3=1 << 3 | 1 << 4)
    assert bench.run(at, b"", at + len(code))[2] == 6


@pytest.fixture
def s3() -> Iterator[Bench]:
    with VirtualChip(Chip.ESP32S3) as chip:
        yield Bench(chip, Chip.ESP32S3)


def test_lines_of_an_address_are_invalidated(s3: Bench) -> None:
    at, code = FLASH[s3.kind], c.NOP * 63
    s3.run(at, code)
    s3.call_rom(INVALIDATE_ADDRESS, at + LINE, LINE + 1)
    assert s3.run(at, b"", at + len(code))[2] == 2


def test_the_image_configures_the_caches_of_the_s3(s3: Bench) -> None:
    """Lines of 16 bytes: twice as many misses, each (24 + 64) clocks. 32 KB in four ways: 8 KB apart is one set."""
    at, code = FLASH[s3.kind], c.NOP * 63
    s3.call_rom(CONFIGURE_CODE, 0x8000, 4, 16)
    s3.line_cycles = (24 + 64) * 3
    assert s3.run(at, code)[2] == 12
    s3.call_rom(CONFIGURE_DATA, 0x10000, 8, 64)
    s3.line_cycles = (24 + 256) * 3
    s3.chip.write(FLASH_DATA[s3.kind], bytes(256))
    assert s3.run(RAM[s3.kind], b"".join(c.l32i(3, 2, 4 * n) for n in range(64)), a2=FLASH_DATA[s3.kind])[2] == 4


def test_a_cache_that_no_chip_has_is_named(s3: Bench) -> None:
    with pytest.raises(ChipFault, match="a cache of 12345 bytes, 3 ways, lines of 8 bytes is not emulated"):
        s3.call_rom(CONFIGURE_CODE, 12345, 3, 8)


# clocks before the data and bits a clock, by the data sheets of the flash chips
MODES = {"qio": (1 << 24, 20, 4), "qout": (1 << 20, 40, 4), "dio": (1 << 23, 24, 2), "dout": (1 << 14, 40, 2)}


@pytest.mark.parametrize("mode", MODES.values(), ids=MODES.keys())
@pytest.mark.parametrize("divider", [1, 2, 4])
def test_a_miss_takes_as_long_as_the_flash_is_read(bench: Bench, mode: tuple[int, int, int], divider: int) -> None:
    bits, clocks, width = mode
    place, field = (0x18, 12) if bench.kind == Chip.ESP32 else (0x14, 16)
    clock = 1 << 31 if divider == 1 else (divider - 1) << field
    store = c.s32i(3, 2, 8) + c.s32i(4, 2, place)
    bench.run(RAM[bench.kind], store, a2=SPI0[bench.kind], a3=bits | 1 << 13, a4=clock)
    bench.line_cycles = (clocks + 8 * LINE // width) * 3 * divider
    assert bench.run(FLASH[bench.kind], c.NOP * 5)[:1] == (5 + bench.line_cycles,)


CONTROL = {Chip.ESP32: (0x3FF0002C, 0x3FF00030, 0x3FF00034, 0x3FF00038), Chip.ESP32S3: (0x600C0000, 0x600C0004)}


def test_each_core_of_the_esp32_has_its_own_cache_and_those_of_the_s3_share(bench: Bench) -> None:
    """Core 1 executes what core 0 has executed."""
    at, stays = FLASH[bench.kind], c.jump(0)
    bench.run(at, c.NOP * 63)
    bench.chip.write(at + 189, stays)
    if bench.kind == Chip.ESP32:  # boot address, clock on, no reset
        code = c.s32i(3, 2, 12) + c.s32i(4, 2, 4) + c.s32i(5, 2, 0)
    else:
        code = c.s32i(3, 2, 4) + c.s32i(6, 2, 0)
    bench.run(RAM[bench.kind], code + c.NOP, a2=CONTROL[bench.kind][0], a3=at, a4=1, a5=0, a6=2)
    bench.chip.write(RAM[bench.kind] + 0x1000, stays)
    bench.chip.set_cpu(Cpu(pc=RAM[bench.kind] + 0x1000, ps=0x20, windowstart=1))
    bench.chip.run(100_000)
    core = bench.chip.core(1)
    assert core.instructions > 63
    assert core.misses == (6 if bench.kind == Chip.ESP32 else 0)


def test_lines_of_both_cores_come_one_after_the_other(bench: Bench) -> None:
    """Both begin in lines of their own at the same time: the second one waits for the flash chip, too."""
    at, stays = FLASH[bench.kind], c.jump(0)
    bench.chip.write(at, c.NOP * 3 + stays)
    bench.chip.write(at + 0x1000, c.NOP * 3 + stays)
    code = (c.s32i(3, 2, 12) + c.s32i(4, 2, 4) + c.s32i(5, 2, 0)) if bench.kind == Chip.ESP32 else (
        c.s32i(3, 2, 4) + c.s32i(6, 2, 0)
    )  # fmt: skip
    bench.chip.write(RAM[bench.kind], code + c.wide(0, 10, 7))  # jx a7
    cpu = Cpu(pc=RAM[bench.kind], ps=0x20, windowstart=1)
    cpu.a[2], cpu.a[3], cpu.a[4], cpu.a[6], cpu.a[7] = CONTROL[bench.kind][0], at, 1, 2, at + 0x1000
    bench.chip.set_cpu(cpu)
    bench.chip.run(20_000)
    waited = sorted(bench.chip.core(n).missing for n in (0, 1))
    assert [bench.chip.core(n).misses for n in (0, 1)] == [1, 1]
    assert waited[0] == MISS[bench.kind] and MISS[bench.kind] < waited[1] <= 2 * MISS[bench.kind]


# ---- pipeline: GCC's description of Xtensa ----

L8UI = c.immediate(2, 3, 2, 0, 0)
ADDS, MULS = c.wide(0, 2, 1, 3, 10, 0), c.wide(0, 2, 3, 4, 10, 2)  # f3 = f1 + f2; f4 = f3 * f2
CASES = {
    "one each": (c.NOP * 7, 7),
    "a load, used at once": (c.l32i(3, 2, 0) + c.addi(4, 3, 1), 3),
    "a load, used later": (c.l32i(3, 2, 0) + c.NOP + c.addi(4, 3, 1), 3),
    "a load, not used": (c.l32i(3, 2, 0) + c.addi(4, 5, 1), 2),
    "a byte, stored at once": (L8UI + c.s32i(3, 2, 4), 3),
    "a load that gives the address": (c.l32i(3, 2, 8) + c.l32i(4, 3, 0), 3),
    "a product, used at once": (c.wide(0, 5, 4, 3, 2, 8) + c.addi(4, 3, 1), 3),
    "a quotient": (c.wide(0, 2, 2, 3, 2, 12), 32),
    "a jump": (c.jump(6) + c.NOP + c.NOP, 1 + TAKEN + 1),
    "a branch that is taken": (
        (6 | 1 << 4 | 5 << 8 | 0xFFF << 12).to_bytes(3, "little") + c.NOP,
        1 + TAKEN + 1,
    ),  # beqz
    "a branch that is not": ((6 | 5 << 4 | 5 << 8 | 0xFFF << 12).to_bytes(3, "little") + c.NOP, 2),
    "floats, one after the other": (ADDS + MULS, 1 + 3 + 1),
    "floats, apart by one": (ADDS + c.NOP + MULS, 1 + 2 + 1 + 1),
    "floats, apart by three": (ADDS + c.NOP * 3 + MULS, 5),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_cycles_of_instructions(bench: Bench, case: tuple[bytes, int]) -> None:
    code, cycles = case
    data = DATA[bench.kind]
    bench.chip.write(data, bytes(8) + data.to_bytes(4, "little"))
    assert bench.run(RAM[bench.kind], code, a2=data, a5=0)[0] == cycles


def test_each_takes_a_cycle_if_nothing_else_is_wanted(bench: Bench) -> None:
    bench.chip.timing(False)
    bench.chip.write(FLASH_DATA[bench.kind], bytes(64))
    code = c.l32i(3, 2, 0) + c.addi(4, 3, 1) + c.jump(3) + c.wide(0, 2, 2, 3, 2, 12)
    assert bench.run(FLASH[bench.kind], code, a2=FLASH_DATA[bench.kind]) == (4, 4, 0)


# ---- registers ----


def test_registers_cost_the_bus(bench: Bench) -> None:
    """A load waits for its value; after a store the core continues, and the next access or MEMW waits for it."""
    at, out = RAM[bench.kind], GPIO_OUT[bench.kind]
    load, store = c.l32i(3, 2, 0), c.s32i(3, 2, 0)
    assert bench.run(at, load, a2=out)[0] == 1 + BUS
    assert bench.run(at, load + c.l32i(4, 2, 0) + c.l32i(5, 2, 0), a2=out)[0] == 3 * (1 + BUS)
    bench.run(at, c.NOP * BUS)
    assert bench.run(at, store, a2=out)[0] == 1
    bench.run(at, c.NOP * BUS)
    assert bench.run(at, store * 4, a2=out)[0] == 1 + 3 * BUS
    bench.run(at, c.NOP * BUS)
    assert bench.run(at, store + MEMW, a2=out)[0] == 1 + BUS
    bench.run(at, c.NOP * BUS)
    assert bench.run(at, MEMW * 5, a2=out)[0] == 5
