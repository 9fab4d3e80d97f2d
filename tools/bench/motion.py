"""How good the motion is, from the step edges alone: `make bench-motion [FILES='a.nc b.nc']`.

Exit code 1 when a budget is broken.
"""

from __future__ import annotations

import hashlib
import sys
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from wificnc.profile import Machine, load_machine

from bench.jobs import write_jobs
from bench.measure import BUILD, ROOT, Figure, build_driver, counters, has_valgrind, planning, profile_job
from bench.optimum import optimal_time_s
from bench.program import Floats, Programmed, read_program
from bench.steps import Steps, derivative, deviation, read_steps

TIMER_HZ = 10e6  # of tools/bench/drive.c
JERK_MM_S3 = 20_000.0
JERK_WINDOW_S = 0.020
FINE_MAX = 1.1
FINER = 10  # steps in one of the machine's, where rounding to whole steps would hide what is measured
EXAMPLES = ("inlay.nc", "pcb_isolation.nc", "pcb_outline.nc", "plot.nc", "relief.nc")
BASELINE = ROOT / "examples" / "machines" / "baseline.toml"

METHOD = """
Settings of {baseline}; the controller gets the file as fast as it takes it.
time       virtual time from the first line to rest, without dwells (G4)
t_topp     time-optimal timing of the path smoothed inside a tube of $11 (tools/bench/optimum.py), no jerk limit;
           at rest where the program rests (M3, M8, G4 ...)
a10 a20    greatest acceleration of any axis, from the step trace by box differences over 10 and 20 ms; one step in
           10 ms is {grain:.0f} mm/s2
fine a10   the same with steps {finer} times finer, so that rounding to whole steps is not in it
path       greatest distance of any step from the programmed path, and of any programmed vertex from the steps
jerk       the same run with $40={jerk:.0f}: greatest jerk of any axis over windows of 20 ms, of which one step early
           or late at each end of each window is {jerk_grain:.0f}; changes within shorter times are seen by
           tests/motion/test_motion_jerk.py, with finer steps
stalls     the same run with a stall of the task side, the motion side or the reader each 100 ms on average, 1 to 200 ms
           long: a10 and path again, and a10 with the finer steps
starved    stops for want of look-ahead while input was there
unmet      times the planned speed could not be followed within the limits
instr      planner, per block, by callgrind
"""


@dataclass(frozen=True)
class Limits:
    """Of all axes of the measuring machine."""

    settings: tuple[str, ...]
    steps_per_mm: float
    rate_mm_s: float
    accel_mm_s2: float
    tolerance_mm: float

    @property
    def jerk_grain_mm_s3(self) -> float:
        return 4.0 / (self.steps_per_mm * JERK_WINDOW_S**3)

    def finer(self) -> Limits:
        """The same machine with steps so small that their rounding is not seen."""
        steps_per_mm = FINER * self.steps_per_mm
        others = [line for line in self.settings if not line.startswith(("$100=", "$101=", "$102="))]
        fine = [f"${number}={steps_per_mm:g}" for number in (100, 101, 102)]
        return replace(self, settings=(*others, *fine), steps_per_mm=steps_per_mm)


@dataclass(frozen=True)
class Report:
    """One file's row."""

    name: str
    figures: tuple[Figure, ...]
    where: str


def main(arguments: Sequence[str]) -> int:
    limits = baseline(load_machine(str(BASELINE)))
    files = [Path(name).resolve() for name in arguments] or default_files()
    grain = 1.0 / (limits.steps_per_mm * 0.010**2)
    about = BASELINE.relative_to(ROOT)
    print(METHOD.format(baseline=about, grain=grain, finer=FINER, jerk=JERK_MM_S3, jerk_grain=limits.jerk_grain_mm_s3))
    driver = build_driver()
    broken = 0
    for number, file in enumerate(files):
        report = measure(driver, file, limits)
        if number == 0:
            print(heading(report))
        print(row(report), flush=True)
        for figure in report.figures:
            if not figure.is_met:
                broken += 1
                print(
                    f"    OVER: {figure.name} {figure.value:.4g} {figure.unit}, budget {figure.limit:.4g}{report.where}"
                )
    print(f"\n{broken} budgets broken" if broken else "\nall budgets kept")
    return 1 if broken else 0


def baseline(machine: Machine) -> Limits:
    x = machine.axis.x
    assert x is not None and machine.motion.junction_deviation_mm is not None
    settings = tuple(machine.settings_lines())
    tolerance = machine.motion.junction_deviation_mm
    return Limits(settings, x.steps_per_mm, x.max_rate_mm_min / 60.0, x.acceleration_mm_s2, tolerance)


def default_files() -> list[Path]:
    return [*(ROOT / "examples" / name for name in EXAMPLES), *write_jobs(BUILD / "jobs")]


def measure(driver: Path, file: Path, limits: Limits) -> Report:
    """All figures of one file."""
    program = read_program(file)
    trace = BUILD / f"{file.stem}.trace"
    count = counters(driver, file, limits.settings, trace=trace)
    steps = read_steps(trace, TIMER_HZ, np.full(3, limits.steps_per_mm), len(limits.settings))
    trace.unlink()
    time_s = count["ticks"] / TIMER_HZ - steps.pause_s
    best_s = reference_s(file, program, limits)
    a10, a20 = (derivative(steps, 2, window_s) / limits.accel_mm_s2 for window_s in (0.010, 0.020))
    _, fine_a10 = run(driver, file, limits.finer())
    away = deviation(steps, program)
    step_mm = 1.0 / limits.steps_per_mm
    figures = (
        Figure("time", time_s, "s"),
        Figure("t_topp", best_s, "s"),
        Figure("ratio", time_s / best_s, "x", 1.05),
        Figure("a10 max", float(a10.max()), "x", 1.2),
        Figure("fine a10", float(fine_a10.max()), "x", FINE_MAX),
        Figure("a10 99.9 %", float(np.quantile(a10, 0.999)), "x", 1.13),
        Figure("a20 99.9 %", float(np.quantile(a20, 0.999)), "x", 1.03),
        Figure("path um", 1e3 * away.path_mm, "um", 1e3 * (limits.tolerance_mm + step_mm)),
        Figure("vertex um", 1e3 * away.vertex_mm, "um", 1e3 * (limits.tolerance_mm + step_mm)),
        *with_stalls(driver, file, program, limits),
        *with_jerk(driver, file, limits, steps.pause_s, time_s),
        Figure("starved", count["starved"], "times", 0),
        Figure("unmet", count["unmet"], "times", 0),
        *instructions(driver, file, limits, count["blocks"]),
    )
    return Report(file.stem, figures, f"; farthest from the path at line {away.line}; {worst_place(steps.t_s, a10)}")


def worst_place(t_s: Floats, accel: Floats) -> str:
    return f"greatest acceleration at {int(np.argmax(accel)) * 0.001 - 0.020:.3f} s of {t_s[-1] - t_s[0]:.3f} s"


def run(driver: Path, file: Path, limits: Limits, seed: int | None = None) -> tuple[Steps, Floats]:
    """The steps, and the acceleration in windows of 10 ms as part of the limit. @param seed  of stalls; None: none"""
    trace = BUILD / f"{file.stem}.trace"
    counters(driver, file, limits.settings, trace=trace, seed=seed)
    steps = read_steps(trace, TIMER_HZ, np.full(3, limits.steps_per_mm), len(limits.settings))
    trace.unlink()
    return steps, derivative(steps, 2, 0.010) / limits.accel_mm_s2


def with_stalls(driver: Path, file: Path, program: Programmed, limits: Limits) -> tuple[Figure, ...]:
    seed = zlib.crc32(file.name.encode())
    steps, a10 = run(driver, file, limits, seed)
    _, fine_a10 = run(driver, file, limits.finer(), seed)
    away, step_mm = deviation(steps, program), 1.0 / limits.steps_per_mm
    return (
        Figure("stalls a10", float(a10.max()), "x", 1.2),
        Figure("fine stalls", float(fine_a10.max()), "x", FINE_MAX),
        Figure("stalls um", 1e3 * max(away.path_mm, away.vertex_mm), "um", 1e3 * (limits.tolerance_mm + step_mm)),
    )


def with_jerk(driver: Path, file: Path, limits: Limits, pause_s: float, plain_s: float) -> tuple[Figure, ...]:
    settings = (*limits.settings, f"$40={JERK_MM_S3:g}")
    trace = BUILD / f"{file.stem}.trace"
    count = counters(driver, file, settings, trace=trace)
    steps = read_steps(trace, TIMER_HZ, np.full(3, limits.steps_per_mm), len(settings))
    trace.unlink()
    jerk = float(derivative(steps, 3, JERK_WINDOW_S).max())
    most = 1.0 + limits.jerk_grain_mm_s3 / JERK_MM_S3
    return (
        Figure("jerk max", jerk / JERK_MM_S3, "x", most),
        Figure("time with $40", (count["ticks"] / TIMER_HZ - steps.pause_s) / plain_s, "x", 1.7),
    )


def instructions(driver: Path, file: Path, limits: Limits, blocks: int) -> tuple[Figure, ...]:
    if not has_valgrind():
        return ()
    return (Figure("instr", planning(profile_job(driver, file, limits.settings)) / blocks, "per block"),)


def reference_s(file: Path, program: Programmed, limits: Limits) -> float:
    """optimal_time_s(), kept: it takes a minute for a long file."""
    code = b"".join(Path(__file__).with_name(name).read_bytes() for name in ("optimum.py", "program.py"))
    key = hashlib.sha256(code + file.read_bytes() + repr(limits).encode()).hexdigest()
    kept = BUILD / "optimum" / key
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        best_s = optimal_time_s(program, limits.tolerance_mm, limits.rate_mm_s, limits.accel_mm_s2)
        kept.write_text(f"{best_s!r}\n")
    return float(kept.read_text())


def heading(report: Report) -> str:
    return f"{'file':<28}" + "".join(f"{figure.name:>{_width(figure)}}" for figure in report.figures)


def row(report: Report) -> str:
    def text(figure: Figure) -> str:
        return f"{figure.value:.3f}" if figure.unit in ("s", "x") else f"{figure.value:.1f}"

    return f"{report.name:<28}" + "".join(f"{text(figure):>{_width(figure)}}" for figure in report.figures)


def _width(figure: Figure) -> int:
    return max(len(figure.name), 8) + 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
