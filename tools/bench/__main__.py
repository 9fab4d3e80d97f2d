"""Print what the controller costs, and how that was measured. Exit code 1 when a budget is broken."""

from __future__ import annotations

import platform
import sys

from wificnc.build.host import RAM_BUDGET_BYTES, build_host, core_ram_bytes

from bench import motion_cost, traffic
from bench.measure import FAST, ROOT, Figure, build_driver, has_valgrind, instructions, wall_clock

JOB = ROOT / "examples" / "relief.nc"

METHOD = """
Instructions: valgrind --tool=callgrind on tools/bench/drive.c. The ISR with all it calls, over long moves of three
axes at full rate; the rest is a room's own functions and the C library below them, over the real job."""

SPEED_METHOD = """
Speed: `wificnc sim` on the real job, repeated to 40 000 lines, as a process of its own; best of three. Rates are
without Python's start."""


def main() -> int:
    build = build_host()
    build_driver()
    print(f"compiler     {build.compiler.title}, -O2, {platform.machine()}")
    print(f"real job     {JOB.relative_to(ROOT)}; settings {' '.join(FAST)}")
    figures = [Figure("static RAM of one controller", core_ram_bytes(build.library), "bytes", RAM_BUDGET_BYTES)]
    print("\nMemory: sizeof struct machine, which holds every buffer of the core.")
    show(figures)
    if has_valgrind():
        print(METHOD)
        figures += show(instructions(JOB))
        for heading, part in (*motion_cost.report(), *traffic.report()):
            print(heading)
            figures += show(part)
    else:
        print("\nInstructions: not measured, there is no valgrind here (Debian: apt-get install valgrind).")
    print(SPEED_METHOD)
    figures += show(wall_clock(JOB))
    broken = [figure.name for figure in figures if not figure.is_met]
    if broken:
        print(f"\nover budget: {', '.join(broken)}")
    return 1 if broken else 0


def show(figures: list[Figure]) -> list[Figure]:
    for figure in figures:
        value = f"{figure.value:,.0f}" if figure.value >= 100 else f"{figure.value:.2f}"
        bound = "" if figure.limit is None else f"{'>=' if figure.at_least else '<='} {figure.limit:,g}"
        mark = "" if figure.is_met else "  OVER"
        print(f"  {figure.name:<44} {value:>10} {figure.unit:<16} {bound}{mark}")
    return figures


if __name__ == "__main__":
    sys.exit(main())
