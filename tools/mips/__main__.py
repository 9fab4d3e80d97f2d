"""`python -m mips ELF`: check the interrupt handlers of an image, and say how long they are."""

from __future__ import annotations

import sys
from pathlib import Path

from mips.isr import SELDOM, STEP_VECTORS, disassemble, longest_path, read_disassembly, violations


def main(argv: list[str]) -> int:
    """Exit code 0: no rule is broken; 1: some are; 2: there is no image."""
    if len(argv) != 1 or not Path(argv[0]).is_file():
        print("usage: python -m mips build/BOARD/wificnc.elf", file=sys.stderr)
        return 2
    program = read_disassembly(disassemble(Path(argv[0])))
    problems = violations(program)
    print("\n".join(problems) or "interrupt handlers: no call by a pointer, no float, no division, HI and LO safe")
    for vector in STEP_VECTORS:
        print(f"{vector}: {longest_path(program, vector, SELDOM)} instructions at an event within a span", end=", ")
        print(f"{longest_path(program, vector)} at most")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
