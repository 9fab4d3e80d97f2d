"""The segment ring between two real threads."""

from __future__ import annotations

import subprocess
from pathlib import Path

from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

HERE = Path(__file__).parent


def test_segments_cross_the_ring_whole_and_in_order_under_thread_sanitizer() -> None:
    program = build_program(
        [HERE / "ring_threads.c"],
        checkout_root() / "build" / "tests" / "ring_threads",
        variant="tsan",
        flags=["-pthread"],
    )
    done = subprocess.run([program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 wrong" in done.stdout
