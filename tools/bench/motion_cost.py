"""What motion costs from a block to the step, and its longest calls: on this computer, on MIPS and on Xtensa."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from itertools import islice
from pathlib import Path

import mips.count
import xtensa_programs.count
from wificnc.profile import load_machine
from wificnc_chips.esp32 import Chip

from bench.callgrind import Profile
from bench.jobs import HEAD, chopped_circle, relief
from bench.measure import BUILD, ROOT, Figure, build_driver, cost_of, counters, profile_job

METHOD = """
Motion, per block and per step, with its polls (1 ms): a surface in chords of 0.2 mm that bends in all axes, and a
circle in chords of 0.016 mm, with the settings of examples/machines/baseline.toml. Planner and emission: core/motion
and core/segment; spans: core/step/prep.c; with the library functions that they call. Longest calls: of motion_poll(),
which makes batches in portions, and of prep_poll(), which cuts them. Here by callgrind, on MIPS by QEMU's user mode
with a plugin that counts (tools/mips/count.py): optimised as the firmware, 4 axes; the step interrupt is counted by
make bench-chip. On Xtensa in the virtual ESP32 and ESP32-S3 (xtensa_programs/count.py): LLVM's code at -O2, 4 axes."""

MIPS_BUDGET = ROOT / "tests" / "budget" / "mips.json"
XTENSA_BUDGET = ROOT / "tests" / "budget" / "xtensa_motion.json"
XTENSA = {"esp32": Chip.ESP32, "esp32s3": Chip.ESP32S3}
SURFACE, CIRCLE = "surface", "chopped circle"
LINES = {SURFACE: (relief, 500), CIRCLE: (chopped_circle, 2500)}
LONGEST = {"motion_poll": 6_500, "prep_poll": 7_500}
PER_BLOCK = {SURFACE: 20_200, CIRCLE: 1_450}
PER_STEP = {SURFACE: 141, CIRCLE: 68}


def write_jobs(folder: Path) -> dict[str, Path]:
    """Both of them as files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for name, (job, lines) in LINES.items():
        paths[name] = folder / f"{name.replace(' ', '_')}.nc"
        paths[name].write_text("\n".join([HEAD, *islice(job(), lines), "M2"]) + "\n")
    return paths


def settings() -> tuple[str, ...]:
    return tuple(load_machine(str(ROOT / "examples" / "machines" / "baseline.toml")).settings_lines())


def here() -> list[Figure]:
    """Instructions of this computer. Raises CalledProcessError when a job has errors."""
    driver, figures = build_driver(), []
    for name, job in write_jobs(BUILD / "cost").items():
        count, profile = counters(driver, job, settings()), profile_job(driver, job, settings())
        motion = _motion(profile) / count["blocks"]
        spans = cost_of(profile, "core/step/prep.c") / count["step_events"]
        figures.append(Figure(f"planner and emission per block, {name}", motion, "instr", PER_BLOCK[name]))
        figures.append(Figure(f"spans per step, {name}", spans, "instr", PER_STEP[name]))
    for function, limit in LONGEST.items():
        job = BUILD / "cost" / "surface.nc"
        figures.append(Figure(f"longest call of {function}()", longest_call(driver, job, function), "instr", limit))
    return figures


def _motion(profile: Profile) -> int:
    return cost_of(profile, "core/motion/", "core/segment/")


def longest_call(driver: Path, job: Path, function: str) -> int:
    """One profile for each call."""
    out = BUILD / f"callgrind.{function}"
    out.unlink(missing_ok=True)
    options = ["--collect-atstart=no", f"--toggle-collect={function}", f"--dump-after={function}"]
    tool = ["valgrind", "--tool=callgrind", "--quiet", "--combine-dumps=yes", f"--callgrind-out-file={out}", *options]
    subprocess.run([*tool, str(driver), "3", str(job), *settings()], capture_output=True, check=True)
    with open(out) as file:
        return max(int(line.split()[1]) for line in file if line.startswith("totals:"))


def on_mips() -> list[Figure]:
    """Instructions of a MIPS processor. Raises CalledProcessError when a job has errors."""
    figures, longest = [], dict.fromkeys(LONGEST, 0)
    for name, job in write_jobs(BUILD / "cost").items():
        count = mips.count.count_job(ROOT, job, settings())
        figures += _figures(name, count.blocks, count.motion, count.prep / count.steps)
        longest = {function: max(most, count.longest[function]) for function, most in longest.items()}
    return _budgeted([*figures, *_longest(longest)], json.loads(MIPS_BUDGET.read_text()))


def on_xtensa(chip: str) -> list[Figure]:
    """Instructions of a chip's processor. Raises RuntimeError when a job has errors. @param chip  of XTENSA"""
    figures, longest = [], dict.fromkeys(LONGEST, 0)
    for name, job in write_jobs(BUILD / "cost").items():
        count = xtensa_programs.count.count_job(XTENSA[chip], job, settings())
        figures += _figures(name, count.blocks, count.motion, count.spans / count.steps)
        longest = {function: max(most, count.longest[function]) for function, most in longest.items()}
    return _budgeted([*figures, *_longest(longest)], json.loads(XTENSA_BUDGET.read_text())[chip])


def _figures(job: str, blocks: int, motion: int, spans: float) -> list[Figure]:
    return [
        Figure(f"planner and emission per block, {job}", motion / blocks, "instr"),
        Figure(f"spans per step, {job}", spans, "instr"),
    ]


def _longest(calls: dict[str, int]) -> list[Figure]:
    return [Figure(f"longest call of {name}()", most, "instr") for name, most in calls.items()]


def _budgeted(figures: list[Figure], budget: dict[str, int]) -> list[Figure]:
    return [replace(figure, limit=budget.get(figure.name, 0)) for figure in figures]


def report() -> list[tuple[str, list[Figure]]]:
    """A heading and the figures below it."""
    found = [(METHOD, here())]
    no_mips, no_xtensa = mips.count.not_here(), xtensa_programs.count.not_here()
    found.append((f"On MIPS: not measured; {no_mips}", []) if no_mips else ("On MIPS:", on_mips()))
    for chip in XTENSA:
        if no_xtensa:
            found.append((f"On the {chip}: not measured; {no_xtensa}", []))
        else:
            found.append((f"On the {chip}:", on_xtensa(chip)))
    return found
