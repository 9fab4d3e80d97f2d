"""Parts of the PIC32MZ's firmware that need no chip, as C programs on this computer."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from patience import HANG_S
from slow import deep_but
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

HERE = Path(__file__).parent
PIC32MZ = checkout_root() / "targets" / "pic32mz"

STORE = ("store/flash_store.c", "store/flash_page.c", "store/flash_layout_1.c")

# program and its arguments -> the firmware's files in it
QUICK = ("flash_store", "15")  # a fifteenth of the rounds
PROGRAMS = {QUICK: STORE, ("flash_store",): STORE, ("store_flips",): STORE}


@pytest.mark.parametrize("command", deep_but(QUICK.__eq__, PROGRAMS), ids="-".join)
def test_program(command: tuple[str, ...]) -> None:
    name, *arguments = command
    sources = [HERE / f"{name}.c", *(PIC32MZ / source for source in PROGRAMS[command])]
    output = checkout_root() / "build" / "tests" / "pic32mz" / name
    program = build_program(sources, output, "release", [f"-I{PIC32MZ}"])
    done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 failures" in done.stdout
