"""A compiler that does not optimise, which takes most of its time: for what only has to be built and run once."""

from __future__ import annotations

import shlex
from pathlib import Path

from wificnc.build.compiler import locate_compiler


def quick_compiler(folder: Path) -> Path:
    """`cc` in that folder: this computer's compiler. Its stack frames have no bound."""
    program = folder / "cc"
    program.write_text(
        f'#!/bin/sh\nexec {shlex.join(locate_compiler())} "$@" -O0 -Wno-frame-larger-than\n', encoding="utf-8"
    )
    program.chmod(0o755)
    return program
