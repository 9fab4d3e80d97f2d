"""What the step interrupt and both cores of the virtual ESP32 take, with the model of caches and pipeline: a part of
`make bench-chip`. Flash and cache are as targets/esp32/sdkconfig.defaults.* have them; with --idf-defaults as ESP-IDF
has them where a project configures nothing."""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from wificnc.build.esp32 import configuration_lines
from wificnc.simulator.run import SimOptions, simulate
from wificnc_chips.esp32 import CPU_HZ, Chip, Core, Level, VirtualChip
from xtensa import windows
from xtensa.toolchain import NoToolchainError, find_toolchain
from xtensa_programs.program import BOARDS, ROOT, Program, build

METHOD = """
Our core, step engine and both tasks' loops on both cores of the virtual chip, without FreeRTOS and ESP-IDF, flash by
DIO. Late: of each step from the PC's simulation, after the median latency;
milliseconds are motion that has braked, as the task side was late. Misses: time in which core 0 waits for flash."""

STEPS_PER_MM = 250
END = "\nM2\n"  # without it the next line may be under way on a chip, while the PC sees the file's end
RATES = (25_000, 50_000, 100_000, 150_000, 200_000, 250_000)
JOBS = {
    "one axis, 83 mm/s": "G91G0X30",
    "diagonal of four axes": "G91G1X10Y7Z3A1F2000\nX-10Y-7Z-3A-1",
    "two arcs": "G2X10Y0I5J0F1500\nG3X0Y0I-5J0",
    "chords of 0.1 mm": "G91\n" + "\n".join(f"G1X0.1Y{(-1) ** n * 0.01}F1500" for n in range(150)),
}
USUAL = tuple(f"${base + axis}={value}" for base, value in ((110, 5000), (120, 500)) for axis in range(4))


@dataclass(frozen=True)
class Flash:
    """How code comes from flash."""

    mhz: int
    code_cache: int  # bytes


IDF_DEFAULTS = {Chip.ESP32: Flash(40, 0x8000), Chip.ESP32S3: Flash(80, 0x4000)}  # and a project that sets nothing
SIZES = {"ESP32S3_INSTRUCTION_CACHE_16KB": 0x4000, "ESP32S3_INSTRUCTION_CACHE_32KB": 0x8000}


def shipped(kind: Chip) -> Flash:
    """As our configuration has it."""
    lines = configuration_lines(ROOT, kind.name.lower(), "release")
    options = {line.removeprefix("CONFIG_").removesuffix("=y") for line in lines if line.endswith("=y")}
    usual = IDF_DEFAULTS[kind]
    speeds = [mhz for mhz in (20, 26, 40, 80) if f"ESPTOOLPY_FLASHFREQ_{mhz}M" in options]
    return Flash(
        next(iter(speeds), usual.mhz), next((SIZES[name] for name in SIZES if name in options), usual.code_cache)
    )


@dataclass(frozen=True)
class Ran:
    interrupt: Level
    cores: tuple[Core, Core]
    late_us: NDArray[np.float64]  # empty: other step events than the PC's
    seconds: float  # from the first step to the last

    @property
    def latest(self) -> str:
        return f"{self.late_us.max():10.2f} us" if len(self.late_us) else "other events"


def fast_settings(rate: int) -> tuple[str, ...]:
    return ("$0=2", f"$100={STEPS_PER_MM}", f"$110={rate * 60 // STEPS_PER_MM}", "$120=5000")


def fast_job(rate: int) -> str:
    """Long enough to reach this rate and keep it for 0.1 s."""
    speed_mm_s = rate / STEPS_PER_MM
    return f"G91G0X{speed_mm_s * speed_mm_s / 5000 + 0.1 * speed_mm_s:.2f}"


def run(kind: Chip, flash: Flash, program: Path, settings: tuple[str, ...], lines: str) -> Ran:
    with tempfile.TemporaryDirectory() as folder:
        job, trace = Path(folder) / "job.nc", Path(folder) / "trace.csv"
        job.write_text(lines + END)
        simulate(SimOptions(file=job, board=BOARDS[kind], settings=settings, trace=trace))
        pc = np.loadtxt(trace, delimiter=",", skiprows=1, usecols=(0, 1), dtype=np.int64, ndmin=2)
    with VirtualChip(kind) as chip:
        chip.configure_flash(flash.mhz, flash.code_cache)
        running = Program(chip, kind, program, "\n".join((*settings, lines)) + END, 1000, two_cores=True)
        running.run(60)
        steps, cores = running.steps(), (chip.core(0), chip.core(1))
    times_us = (steps[:, 0] - steps[0, 0]) * 1e6 / CPU_HZ
    late_us = np.zeros(0)
    if len(steps) == len(pc):
        late_us = times_us - (pc[:, 0] - pc[0, 0]) / 1000
        late_us = np.abs(late_us - np.median(late_us))
    return Ran(running.step_interrupt, cores, late_us, times_us[-1] / 1e6)


def show_jobs(kind: Chip, flash: Flash, program: Path) -> None:
    print(f"\n  {kind.name:26} {'cycles a step interrupt':>24} {'core 0':>8} {'misses':>8} {'core 1':>8} {'late':>10}")
    for name, lines in JOBS.items():
        ran = run(kind, flash, program, USUAL, lines)
        load = [100 * (1 - core.idle / core.cycles) for core in ran.cores]
        missing = 100 * ran.cores[0].missing / ran.cores[0].cycles
        print(
            f"  {name:26} {ran.interrupt.cycles / ran.interrupt.count:10.0f}, most {ran.interrupt.most:6} "
            f"{load[0]:7.1f} % {missing:5.1f} % {load[1]:6.1f} % {ran.latest:>14}"
        )


def show_rates(kind: Chip, flash: Flash, program: Path) -> None:
    print(f"\n  {kind.name:26} {'latest':>14} {'step interrupt':>16}")
    for rate in RATES:
        ran = run(kind, flash, program, fast_settings(rate), fast_job(rate))
        load = 100 * ran.interrupt.cycles / (ran.seconds * CPU_HZ)
        print(f"  {rate:8} steps/s           {ran.latest:>14} {load:14.1f} %")


def main(idf_defaults: bool = False) -> None:
    print(METHOD)
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        print(f"  not measured: {err}")
        return
    if said := windows.missing(tools):
        print(f"  not measured: {said}")
        return
    for kind in Chip:
        program, flash = build(tools, kind), IDF_DEFAULTS[kind] if idf_defaults else shipped(kind)
        print(f"\n  {kind.name}: flash at {flash.mhz} MHz, {flash.code_cache // 1024} KB of cache for code")
        show_jobs(kind, flash, program)
        show_rates(kind, flash, program)


if __name__ == "__main__":
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--idf-defaults", action="store_true", help="slower: what ESP-IDF configures by itself")
    main(reader.parse_args().idf_defaults)
