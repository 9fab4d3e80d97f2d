"""Instructions of motion on a MIPS processor: QEMU's user mode, with a plugin that counts (count.c).

The controller of the PC with the flags of the PIC32MZ's firmware, and as many axes as its board has. Its step interrupt
writes a trace where the chip's writes registers, so that one's own figures are those of the real image (pic32mz.json).
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.build.mips import COMPILER
from wificnc.build.pic32mz import QUICK

from mips.emulate import PROCESSOR, QEMU, compile_files, controller_sources, missing

FLAGS = (
    "-std=gnu11",
    "-Os",
    "-march=mips32r2",
    "-static",
    "-ffunction-sections",
    "-ffp-contract=off",
    "-fno-math-errno",
)
AXES = 4
SIZES = "#define CORE_AXES {axes}\n#define PLAN_SIZE 256\n#define POWER_MARKS 2048\n#define CORE_VECTORS 0\n"

# Each instruction counts for one of these parts. A part calls itself and those above it in this list.
BASE, ISR, PREP, MOTION, OTHERS = range(5)
WATCHED = {"motion_poll": MOTION, "prep_poll": PREP}

FUNCTION = re.compile(r"^ \.text\.(\S+)\s+0x([0-9a-f]+)\s+0x([0-9a-f]+) \S+/(\w+)\.o$", re.MULTILINE)


@dataclass(frozen=True)
class Count:
    """What a job took."""

    blocks: int
    steps: int  # events with a step
    motion: int  # planner, emission, batches
    prep: int
    longest: dict[str, int]  # call of each of WATCHED


def part_of(name: str) -> int | None:
    """The part of an object file; None: it counts for its caller."""
    if name.startswith("base_"):
        return None
    if name.startswith("step_"):
        return PREP if name == "step_prep" else ISR
    return MOTION if name.startswith(("motion_", "segment_")) else OTHERS


def build_driver(root: Path) -> Path:
    """tools/bench/drive.c with as many axes as the chip's board; the linker's map is drive.map. Raises
    BuildError with what the compiler said."""
    folder = root / "build" / "mips" / "count"
    sizes = folder / "sizes" / "hal" / "core_sizes.h"
    sizes.parent.mkdir(parents=True, exist_ok=True)
    text = SIZES.format(axes=AXES)
    if not sizes.exists() or sizes.read_text() != text:
        sizes.write_text(text)
    flags = (*FLAGS, f"-I{folder / 'sizes'}")
    drive = root / "tools" / "bench" / "drive.c"
    sources = [*controller_sources(root), drive]
    quick = [source for source in sources if source.relative_to(root).as_posix().startswith(QUICK)]
    objects = compile_files(root, [source for source in sources if source not in quick], folder, flags)
    objects += compile_files(root, quick, folder, (*flags, "-O2"))
    program = folder / "drive"
    _run([COMPILER, *flags, *map(str, objects), "-lm", f"-Wl,-Map={program}.map", "-o", str(program)])
    return program


def count_job(root: Path, job: Path, settings: Sequence[str]) -> Count:
    """Run a job. Raises BuildError, CalledProcessError when it has errors."""
    program = build_driver(root)
    table = program.with_name("table")
    names = _write_table(Path(f"{program}.map").read_text(), table)
    with tempfile.TemporaryDirectory() as temporary:
        plugin = Path(temporary) / "libcount.so"
        source = str(Path(__file__).with_name("count.c"))
        _run(["cc", "-std=c11", "-O2", "-shared", "-fPIC", source, "-o", str(plugin)])
        options = ["-cpu", PROCESSOR, "-plugin", f"{plugin},table={table}"]
        argv = [QEMU, *options, str(program), str(AXES), str(job), *settings]
        done = subprocess.run(argv, capture_output=True, text=True, check=True)
    counters = json.loads(done.stdout)
    parts = {int(part): int(count) for part, count in re.findall(r"^part (\d+) (\d+)$", done.stderr, re.MULTILINE)}
    calls = re.findall(r"^call (\w+) (\d+)$", done.stderr, re.MULTILINE)
    longest = {names[int(start, 16)]: int(count) for start, count in calls}
    return Count(counters["blocks"], counters["step_events"], parts[MOTION], parts[PREP], longest)


def not_here() -> str:
    """What to install; "" when all is here."""
    return missing() or ("" if shutil.which("cc") else "apt-get install gcc")


def _write_table(layout: str, table: Path) -> dict[int, str]:
    """Of the linker's map. @return the functions that are watched"""
    lines, names = [], {}
    for name, start, size, file in FUNCTION.findall(layout):
        part, begin = part_of(file), int(start, 16)
        if part is None or int(size, 16) == 0:
            continue
        watched = name in WATCHED and WATCHED[name] == part
        if watched:
            names[begin] = name
        lines.append(f"{begin:x} {begin + int(size, 16):x} {part} {int(watched)}\n")
    table.write_text("".join(lines))
    return names


def _run(argv: Sequence[str]) -> None:
    done = subprocess.run(argv, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
