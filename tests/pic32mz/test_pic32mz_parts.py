"""Parts of the PIC32MZ's firmware that need no chip, as C programs on this computer."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from patience import HANG_S
from slow import slow_but
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

HERE = Path(__file__).parent
PIC32MZ = checkout_root() / "targets" / "pic32mz"

STORE = ("store/flash_store.c", "store/flash_page.c", "store/flash_layout_1.c")

# program -> the firmware's files in it
PROGRAMS = {"flash_store": STORE, "store_flips": STORE}


@pytest.mark.parametrize("name", slow_but("flash_store".__eq__, PROGRAMS))
def test_program(name: str) -> None:
    sources = [HERE / f"{name}.c", *(PIC32MZ / source for source in PROGRAMS[name])]
    output = checkout_root() / "build" / "tests" / "pic32mz" / name
    program = build_program(sources, output, "release", [f"-I{PIC32MZ}"])
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 failures" in done.stdout
