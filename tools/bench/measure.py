"""The measurements: instructions under callgrind, and the wall clock of whole runs."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.build.host import build_program

from bench.callgrind import Profile, parse_callgrind

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "bench"

# A quick machine, so that the steps come at the rate the board allows.
FAST = (
    "$100=250",
    "$101=250",
    "$102=250",
    "$110=24000",
    "$111=24000",
    "$112=24000",
    "$120=4000",
    "$121=4000",
    "$122=4000",
)


@dataclass(frozen=True)
class Figure:
    """One line of the report. limit: the most it may be, or with `at_least` the least; None: no budget."""

    name: str
    value: float
    unit: str
    limit: float | None = None
    at_least: bool = False

    @property
    def is_met(self) -> bool:
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value <= self.limit


def build_driver() -> Path:
    """tools/bench/drive.c with the host controller's objects: no Python inside what is measured."""
    return build_program([Path(__file__).with_name("drive.c")], BUILD / "drive")


def receive_cost() -> float:
    """Instructions for a byte of a serial port, from the read to the receive ring."""
    esp32 = ROOT / "targets" / "esp32"
    sources = [ROOT / "tests" / "esp32" / "receive_cost.c", esp32 / "link" / "improv.c"]
    program = build_program(sources, BUILD / "receive", flags=[f"-I{esp32}"])
    out = BUILD / "callgrind.receive"
    tool = ["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={out}"]
    run = subprocess.run([*tool, str(program)], capture_output=True, text=True, check=True)
    with open(out) as file:
        profile = parse_callgrind(file)
    cost = sum(cost for (name, _), cost in profile.self_cost.items() if "receive_cost.c" not in name)
    return cost / int(json.loads(run.stdout)["bytes"])


def write_diagonal(axes: str = "XYZ", lines: int = 12) -> Path:
    """Long moves of all these axes at full rate: the step ISR's worst diet."""
    BUILD.mkdir(parents=True, exist_ok=True)
    path = BUILD / f"diagonal{len(axes)}.nc"
    ends = " ".join(f"{axis}{60 - 5 * n}" for n, axis in enumerate(axes))
    starts = " ".join(f"{axis}0" for axis in axes)
    moves = [f"G1 {ends if n % 2 else starts}" for n in range(1, lines + 1)]
    path.write_text("\n".join(["G21 G90 G94 F24000", *moves, "M2"]) + "\n")
    return path


# A line as CAM programs write it when every word changes.
SAMPLE = "G1 X12.345 Y-6.789 F1500"


def write_sample(lines: int = 2000) -> Path:
    """That line and its way back, over and over."""
    BUILD.mkdir(parents=True, exist_ok=True)
    path = BUILD / "sample.nc"
    back = SAMPLE.replace("12.345", "12.346")
    path.write_text("\n".join(["G21 G90 G94", *[SAMPLE, back] * (lines // 2), "M2"]) + "\n")
    return path


def write_dense(lines: int = 10_000) -> Path:
    """Curves chopped into chords of 0.016 mm, as CAM programs with a tight tolerance do."""
    BUILD.mkdir(parents=True, exist_ok=True)
    path = BUILD / "dense.nc"
    angles = [math.tau * n / lines for n in range(1, lines + 1)]
    points = [f"X{25.4 * math.sin(a):.4f} Y{25.4 * math.cos(a):.4f}" for a in angles]
    path.write_text("\n".join(["G21 G90 G94", "G0 Y25.4", "G1 F9999", *points, "M2"]) + "\n")
    return path


ENGRAVER = ("$32=1", "$100=80", "$101=80", "$110=30000", "$111=30000", "$120=3000", "$121=3000")
PIXELS = 8000


def write_row() -> Path:
    """A row of an engraved picture at 500 mm/s: 20 changes of S a mm, 10 000 a second."""
    BUILD.mkdir(parents=True, exist_ok=True)
    path = BUILD / "row.nc"
    pixels = [f"X{45 + n / 20:.2f} S{n * 379 % 1000}" for n in range(1, PIXELS + 1)]
    path.write_text(
        "\n".join(["G21 G90 G94 M4", "G1 X45 S0 F30000", *pixels, f"X{90 + PIXELS / 20:g} S0", "M2"]) + "\n"
    )
    return path


def write_long(job: Path, lines: int = 40_000) -> Path:
    """A job of that many lines: the real one over and over."""
    path = BUILD / "long.nc"
    *body, end = job.read_text().splitlines()
    path.write_text("\n".join([*(body * (lines // len(body) + 1))[: lines - 1], end]) + "\n")
    return path


def counters(
    driver: Path, job: Path, settings: Sequence[str], axes: int = 3, trace: Path | None = None, seed: int | None = None
) -> dict[str, int]:
    """The driver's work counters, and all step events if wanted; with a seed, the same with stalls.

    Raises CalledProcessError when the job has errors."""
    options = [*(["-t", str(trace)] if trace else []), *(["-s", str(seed)] if seed is not None else [])]
    argv = [str(driver), *options, str(axes), str(job), *settings]
    run = subprocess.run(argv, capture_output=True, text=True, check=True)
    result: dict[str, int] = json.loads(run.stdout)
    return result


def profile_job(driver: Path, job: Path, settings: Sequence[str], axes: int = 3) -> Profile:
    """The driver's run of a job under callgrind."""
    out = BUILD / f"callgrind.{job.stem}"
    tool = ["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={out}"]
    argv = [*tool, str(driver), str(axes), str(job), *settings]
    subprocess.run(argv, capture_output=True, text=True, check=True)
    with open(out) as file:
        return parse_callgrind(file)


def instructions(job: Path) -> list[Figure]:
    """Instructions per unit of work, on the host build at -O2."""
    driver, diagonal = build_driver(), write_diagonal()
    count = counters(driver, diagonal, FAST)
    profile = profile_job(driver, diagonal, FAST)
    events = count["timer_events"]
    six = write_diagonal("XYZABC")
    fast = [
        *FAST,
        *(f"${base + n}={value}" for n in (3, 4, 5) for base, value in ((100, 250), (110, 24000), (120, 4000))),
    ]
    six_events = counters(driver, six, fast, axes=6)["timer_events"]
    six_isr = profile_job(driver, six, fast, axes=6).inclusive("step_isr") / six_events
    figures = [
        Figure("step ISR per step event, 3 axes, full rate", profile.inclusive("step_isr") / events, "instr", 48),
        Figure("the same with 6 axes", six_isr, "instr", 70),
        Figure("span preparation per step event", cost_of(profile, "core/step/prep.c") / events, "instr", 32),
    ]
    count = counters(driver, job, FAST)
    profile = profile_job(driver, job, FAST)
    blocks, lines, spans = count["blocks"], count["lines"], count["spans"]
    sample_lines = counters(driver, write_sample(), FAST)["lines"]
    sample = profile_job(driver, write_sample(), FAST)
    dense_blocks = counters(driver, write_dense(), FAST)["blocks"]
    dense = profile_job(driver, write_dense(), FAST)
    moves = cost_of(profile, "core/motion/joints.c", "core/motion/kinematics/")
    return [
        *figures,
        Figure("planning per block, 3-D with few points to leave out", planning(profile) / blocks, "instr", 7300),
        Figure("planning per block, finely chopped curves", planning(dense) / dense_blocks, "instr", 720),
        Figure("kinematics per block", moves / blocks, "instr"),
        Figure("line reading and parsing per line", reading(profile) / lines, "instr", 460),
        Figure(f"the same for {SAMPLE}", reading(sample) / sample_lines, "instr", 600),
        Figure("a serial port's byte up to the receive ring", receive_cost(), "instr", 110),
        Figure("segment emission per segment", emission(profile) / count["segments"], "instr"),
        Figure("span preparation per span", cost_of(profile, "core/step/prep.c") / spans, "instr"),
        *engraving(driver),
    ]


ENGRAVING = {
    "lines": ("core/input/", "core/gcode/", "core/machine/"),
    "planning and segments": ("core/motion/", "core/segment/"),
    "spans and step interrupt": ("core/step/",),
}


def engraving(driver: Path) -> list[Figure]:
    """What a change of S costs on its way from the line to the output."""
    row = profile_job(driver, write_row(), ENGRAVER)
    costs = {part: cost_of(row, *files) / PIXELS for part, files in ENGRAVING.items()}
    parts = [Figure(f"engraving, per change of S: {part}", cost, "instr") for part, cost in costs.items()]
    return [*parts, Figure("engraving, per change of S: all", sum(costs.values()), "instr", 8_000)]


def cost_of(profile: Profile, *files: str) -> int:
    """Profile.room() of files and folders that are there: a figure must not lose one that was renamed."""
    if missing := [name for name in files if not (ROOT / name).exists()]:
        raise FileNotFoundError(f"{', '.join(missing)}: renamed? tools/bench/measure.py counts it")
    return profile.room(*files)


def planning(profile: Profile) -> int:
    """From moves to a smooth path and the backward pass of its timing, and when to publish it."""
    return cost_of(profile, *(f"core/motion/{room}.c" for room in ("motion", "reduce", "path", "timing")))


def emission(profile: Profile) -> int:
    """From the path, in time, to segments."""
    return cost_of(profile, *(f"core/motion/{room}.c" for room in ("emit", "forward", "ramp")))


def reading(profile: Profile) -> int:
    """From the bytes of the receive buffer to a command."""
    return cost_of(profile, "core/input/line_reader.c", "core/gcode/")


def wall_clock(job: Path) -> list[Figure]:
    """`wificnc sim` on a real file made 40 000 lines long: whole process, best of three, start of Python included."""
    job = write_long(job)
    plain, events = _sim(job)
    csv = BUILD / "trace.csv"
    with_csv, _ = _sim(job, "--trace", str(csv))
    csv.unlink()
    start = _best([sys.executable, "-m", "wificnc", "sim", "--help"])
    lines = job.read_text().count("\n")
    return [
        Figure(f"{lines} lines, wall time", plain, "s", 10),
        Figure("simulation, no trace", events / (plain - start) / 1e6, "M step events/s", 2, at_least=True),
        Figure("simulation, CSV trace", events / (with_csv - start) / 1e3, "k step events/s", 500, at_least=True),
    ]


def _sim(job: Path, *options: str) -> tuple[float, int]:
    """@return seconds and step events."""
    out = BUILD / "sim.json"
    settings = [word for setting in FAST for word in ("--set", setting)]
    argv = [sys.executable, "-m", "wificnc", "sim", str(job), *settings, "--json", str(out), *options]
    seconds = _best(argv)
    return seconds, counters(build_driver(), job, FAST)["step_events"]


def _best(argv: Sequence[str], times: int = 3) -> float:
    def once() -> float:
        begin = time.perf_counter()
        subprocess.run(argv, capture_output=True, check=True, cwd=ROOT)
        return time.perf_counter() - begin

    return min(once() for _ in range(times))


def has_valgrind() -> bool:
    return shutil.which("valgrind") is not None
