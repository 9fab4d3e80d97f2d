"""`python -m xtensa`: compile the firmware for both chips; with IDF_PATH set, against the real headers."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from wificnc.build.esp32 import Kind

from xtensa.compile import compile_all, firmware_sources, static_ram_bytes
from xtensa.headers import BOARDS, configure, real_headers, small_headers, without_effect
from xtensa.isr import firmware_in_ram, interrupt_program, step_interrupt, violations
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Exit code 0: no error; 1: some file did not compile; 2: no toolchain here."""
    try:
        tools = find_toolchain()
    except NoToolchainError as err:
        print(f"skipped: {err}", file=sys.stderr)
        return 2
    idf = os.environ.get("IDF_PATH")
    failed = 0
    for chip in BOARDS:
        output = ROOT / "build" / "xtensa" / ("idf" if idf else "small") / chip
        headers = real_headers(ROOT, Path(idf), chip, output) if idf else small_headers(ROOT, chip, output)
        if idf:
            failed += _report_options(Path(idf), chip, output)
        begin = time.perf_counter()
        objects = compile_all(tools, ROOT, headers, firmware_sources(ROOT), output)
        bad = [made for made in objects if made.said]
        failed += len(bad)
        for made in bad:
            print(f"{made.source.relative_to(ROOT)}:\n{made.said}")
        kind = f"the headers of {idf}" if idf else "our small headers"
        seconds = time.perf_counter() - begin
        if not bad:
            failed += _report_interrupts(tools, output)
            print(f"static RAM of core and target: {static_ram_bytes(tools, objects):,} bytes ({BOARDS[chip]})")
        print(f"{chip}: {len(objects) - len(bad)} of {len(objects)} files compile with {kind}, {seconds:.1f} s")
    return 1 if failed else 0


def _report_options(idf: Path, chip: str, output: Path) -> int:
    """Of both kinds of build. @return how many lines of our sdkconfig files do nothing."""
    configure(ROOT, idf, chip, debug := output / "debug", "debug")
    kinds: tuple[tuple[Kind, Path], ...] = (("release", output), ("debug", debug))
    idle = 0
    for kind, folder in kinds:
        for line in without_effect(ROOT, chip, kind, (folder / "sdkconfig").read_text()):
            print(f"{chip}, {kind}: {line} of targets/esp32/sdkconfig.* has no effect")
            idle += 1
    return idle


def _report_interrupts(tools: Toolchain, output: Path) -> int:
    """@return how many rules are broken."""
    program = interrupt_program(tools, ROOT, output, firmware_sources(ROOT))
    problems = violations(program, firmware_in_ram(ROOT))
    print("\n".join(problems) or "interrupt handlers: all in RAM, no call outside the list, no float, no division")
    print("step interrupt, instructions:", ", ".join(f"{n} {what}" for what, n in step_interrupt(program).items()))
    return len(problems)


if __name__ == "__main__":
    sys.exit(main())
