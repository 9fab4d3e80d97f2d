"""What a spindle's drive on RS-485 and motor drivers with registers cost in a second, in instructions of a core."""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mips.count
import xtensa_programs.count
from mips.count import FLAGS, FUNCTION
from mips.emulate import PROCESSOR, QEMU, compile_files
from wificnc.build.host import build_program
from wificnc.build.mips import COMPILER
from wificnc.tables.vfd import load_vfds
from wificnc_chips.esp32 import CPU_HZ, Chip, Cpu, VirtualChip
from xtensa.toolchain import find_toolchain
from xtensa_programs import bare
from xtensa_programs import code as c
from xtensa_programs.program import BARE, PS_UM, PS_WOE, STACK_BASE, START

from bench.callgrind import parse_callgrind
from bench.measure import BUILD, ROOT, Figure, cost_of

METHOD = """
Buses, per second: a drive that turns, the dearest model of the table, and drivers with registers while their axes move;
polls of 1 ms, answers byte by byte (tools/bench/traffic.c). core/spindle and core/drivers with what they call; not the
interrupts of the UART."""

SOURCE = Path(__file__).with_name("traffic.c")
BUDGET = ROOT / "tests" / "budget" / "traffic.json"
FOLDERS = ("spindle", "drivers")
SECONDS, WATCHED_LIMIT_S = 2, 60.0
BUS_KINDS = {"vfd": 0, "uart": 1, "spi": 2}  # enum traffic_kind


@dataclass(frozen=True)
class Bus:
    """What is on it."""

    name: str
    kind: str
    what: tuple[int, ...]  # models of $395, of which the dearest counts; or how many drivers


def buses() -> list[Bus]:
    models = tuple(vfd.number for vfd in load_vfds().vfd)
    return [
        Bus("a drive on RS-485", "vfd", models),
        Bus("four TMC2209 on a UART", "uart", (4,)),
        Bus("six TMC5160 in a chain", "spi", (6,)),
    ]


def here() -> list[Figure]:
    """On this computer, by callgrind. Raises CalledProcessError when a bus was lost."""
    program = build_program([SOURCE], BUILD / "traffic")

    def second(kind: str, what: int) -> float:
        most, least = (_callgrind(program, kind, what, seconds) for seconds in (SECONDS, 0))
        return (most - least) / SECONDS

    return _figures(second, buses(), "x86-64")


def on_mips() -> list[Figure]:
    """Of the firmware's flags for the PIC32MZ, which has no bus for drivers. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as temporary:
        program = _mips_program()
        plugin, table = Path(temporary) / "libcount.so", Path(temporary) / "table"
        source = str(ROOT / "tools" / "mips" / "count.c")
        subprocess.run(["cc", "-std=c11", "-O2", "-shared", "-fPIC", source, "-o", str(plugin)], check=True)
        table.write_text(_mips_table(Path(f"{program}.map").read_text()))
        options = [QEMU, "-cpu", PROCESSOR, "-plugin", f"{plugin},table={table}", str(program)]

        def run(kind: str, what: int, seconds: int) -> int:
            argv = [*options, kind, str(what), str(seconds)]
            said = subprocess.run(argv, capture_output=True, text=True, check=True).stderr
            return {int(part): int(count) for part, count in re.findall(r"part (\d+) (\d+)", said)}.get(_OURS, 0)

        def second(kind: str, what: int) -> float:
            return (run(kind, what, SECONDS) - run(kind, what, 0)) / SECONDS

        return _figures(second, buses()[:1], "mips")


def on_xtensa(chip: Chip) -> list[Figure]:
    """In the virtual chip, where each instruction takes a cycle. Raises RuntimeError when a bus was lost."""
    name = bare.PLACES[chip].name
    sources = [path for folder in FOLDERS for path in sorted((ROOT / "core" / folder).glob("*.c"))]
    sources.append(ROOT / "targets" / "pic32mz" / "libc" / "math.c")
    own = [SOURCE, BARE / "runtime.c"]
    program = bare.build(find_toolchain(), ROOT, chip, sources, own, ROOT / "build" / "espsim" / f"{name}-traffic")

    def second(kind: str, what: int) -> float:
        with VirtualChip(chip) as running:
            running.timing(False)  # instructions are counted
            running.load(program.read_bytes())
            _start(running, chip)
            for symbol, value in (("kind", BUS_KINDS[kind]), ("what", what), ("seconds", SECONDS)):
                running.write(running.symbol(symbol), value.to_bytes(4, "little"))
            for _ in range(round(WATCHED_LIMIT_S / 0.05)):
                running.run(CPU_HZ // 20)
                if done := _word(running, "done"):
                    break
            if done != 1:
                raise RuntimeError(f"{kind} {what}: a bus was lost" if done else f"{kind} {what}: does not end")
            return _word(running, "counted") / SECONDS

    return _figures(second, buses(), name)


_OURS, _OTHERS = 3, 4  # parts of tools/mips/count.c; a part calls itself and those above it in its list


def _figures(second: Callable[[str, int], float], measured: list[Bus], processor: str) -> list[Figure]:
    budget = json.loads(BUDGET.read_text(encoding="utf-8"))[processor]
    figures = [Figure(bus.name, max(second(bus.kind, what) for what in bus.what), "instr/s") for bus in measured]
    return [Figure(each.name, each.value, each.unit, budget.get(each.name, 0)) for each in figures]


def _callgrind(program: Path, kind: str, what: int, seconds: int) -> int:
    out = BUILD / f"callgrind.{kind}"
    tool = ["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={out}"]
    subprocess.run([*tool, str(program), kind, str(what), str(seconds)], capture_output=True, check=True)
    with open(out) as file:
        return cost_of(parse_callgrind(file), *(f"core/{folder}/" for folder in FOLDERS))


def _mips_program() -> Path:
    folder = ROOT / "build" / "mips" / "traffic"
    sources = [path for name in FOLDERS for path in sorted((ROOT / "core" / name).glob("*.c"))]
    objects = compile_files(ROOT, [*sources, SOURCE], folder, FLAGS)
    program = folder / "traffic"
    argv = [COMPILER, *FLAGS, *map(str, objects), "-lm", f"-Wl,-Map={program}.map", "-o", str(program)]
    subprocess.run(argv, capture_output=True, check=True)
    return program


def _mips_table(layout: str) -> str:
    """Of the linker's map: functions of the core's folders are one part, those of this program the other."""
    lines = []
    for _, start, size, file in FUNCTION.findall(layout):
        begin = int(start, 16)
        part = _OURS if file.startswith(tuple(f"{folder}_" for folder in FOLDERS)) else _OTHERS
        lines.append(f"{begin:x} {begin + int(size, 16):x} {part} 0\n" if int(size, 16) else "")
    return "".join(lines)


def _start(chip: VirtualChip, kind: Chip) -> None:
    """As Program of xtensa_programs/program.py, without interrupts."""
    vectors = bare.PLACES[kind].vectors
    chip.write(vectors, c.window_vectors())
    loaded = chip.cpu()
    chip.write(vectors + START, c.wide(0, 14, 8))  # callx8 a8
    cpu = Cpu(pc=vectors + START, ps=PS_UM | PS_WOE, vecbase=vectors, cpenable=1, windowstart=1)
    cpu.a[1], cpu.a[8] = loaded.a[1] - STACK_BASE, loaded.pc
    chip.write(cpu.a[1] - 12, int(loaded.a[1]).to_bytes(4, "little"))
    chip.set_cpu(cpu)


def _word(chip: VirtualChip, name: str) -> int:
    return int.from_bytes(chip.read(chip.symbol(name), 4), "little")


def report() -> list[tuple[str, list[Figure]]]:
    """A heading and the figures below it."""
    found = [(METHOD, here())]
    if not mips.count.not_here():
        found.append(("On MIPS:", on_mips()))
    if not xtensa_programs.count.not_here():
        found += [(f"On the {bare.PLACES[chip].name}:", on_xtensa(chip)) for chip in (Chip.ESP32, Chip.ESP32S3)]
    return found
