"""`python -m xtensa`: compile the firmware for both chips; with IDF_PATH set, against the real headers."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.board.shift_registers import pulse_engine
from wificnc.build.esp32 import Kind

from xtensa.compile import (
    Object,
    board_sources,
    compile_all,
    firmware_sources,
    image_bytes,
    static_ram_bytes,
    static_ram_of_board,
)
from xtensa.headers import (
    BOARDS,
    SHIFT_BOARDS,
    Headers,
    configure,
    generate_pins,
    other_boards,
    real_headers,
    rmt_board,
    small_headers,
    with_pins,
    without_effect,
)
from xtensa.isr import STEP, firmware_in_ram, interrupt_program, panic_violations, step_interrupt, violations
from xtensa.stack import task_stacks
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
        (other,) = BOARDS.keys() - {chip}
        objects = compile_all(tools, ROOT, headers, firmware_sources(ROOT), output, twin=output.with_name(other))
        bad = [made for made in objects if made.said]
        failed += len(bad)
        for made in bad:
            print(f"{made.source.relative_to(ROOT)}:\n{made.said}")
        kind = f"the headers of {idf}" if idf else "our small headers"
        seconds = time.perf_counter() - begin
        if not bad:
            failed += _report_interrupts(output)
            _report_ram(tools, chip, output, headers, objects)
            failed += _report_engine(tools, chip, Path(idf) if idf else None, rmt_board(chip, output / "rmt"), output)
            board = load_board(SHIFT_BOARDS[chip])
            failed += _report_engine(tools, chip, Path(idf) if idf else None, board, output)
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


def _report_ram(tools: Toolchain, chip: str, output: Path, headers: Headers, objects: list[Object]) -> None:
    budget = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())["static RAM"][chip]
    used = static_ram_bytes(tools, objects)
    print(f"static RAM of core and target: {used:,} bytes of {budget:,} ({BOARDS[chip]})")
    print(f"code and constants of core and target: {image_bytes(tools, objects):,} bytes, before a linker drops any")
    for board in other_boards(chip):
        folder = output / board.id
        generate_pins(board, folder)
        used = static_ram_of_board(tools, ROOT, with_pins(headers, folder), objects, folder)
        print(f"static RAM of core and target: {used:,} bytes of {budget:,} ({board.id})")


def _report_engine(tools: Toolchain, chip: str, idf: Path | None, board: Board, output: Path) -> int:
    """Step pulses by a peripheral. @return how many files do not compile, or rules are broken."""
    engine, folder = pulse_engine(board).upper(), output / board.step.engine
    headers = real_headers(ROOT, idf, chip, folder, board) if idf else small_headers(ROOT, chip, folder, board)
    sources = board_sources(ROOT)
    bad = [made for made in compile_all(tools, ROOT, headers, sources, folder) if made.said]
    for made in bad:
        print(f"{made.source.relative_to(ROOT)}, {engine}:\n{made.said}")
    if bad:
        return len(bad)
    program = interrupt_program(ROOT, folder, sources)
    problems = violations(program, firmware_in_ram(ROOT), [STEP]) + panic_violations(program, firmware_in_ram(ROOT))
    print("\n".join(problems) or f"with pulses by the {engine}: the same rules are kept")
    print(
        "step interrupt, instructions:", ", ".join(f"{n} {what}" for what, n in step_interrupt(program, ROOT).items())
    )
    return len(problems)


def _report_interrupts(output: Path) -> int:
    """@return how many rules are broken."""
    program = interrupt_program(ROOT, output, firmware_sources(ROOT))
    problems = violations(program, firmware_in_ram(ROOT)) + panic_violations(program, firmware_in_ram(ROOT))
    print(
        "\n".join(problems)
        or "interrupt handlers and panics: all in RAM, no call outside the list, no float, no division"
    )
    print(
        "step interrupt, instructions:", ", ".join(f"{n} {what}" for what, n in step_interrupt(program, ROOT).items())
    )
    for task, (way, size) in task_stacks(program, ROOT).items():
        print(f"stack of the {task} task: {way.bytes:,} of {size:,} bytes, by {' '.join(way.functions)}")
    return len(problems)


if __name__ == "__main__":
    sys.exit(main())
