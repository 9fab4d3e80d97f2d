"""C programs on the core's parts: hand-over between real threads, and segments through prep and the step ISR."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

HERE = Path(__file__).parent


def run(name: str, variant: str, *flags: str) -> str:
    program = build_program([HERE / f"{name}.c"], checkout_root() / "build" / "tests" / name, variant, flags)
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_batches_and_positions_cross_threads_whole_under_thread_sanitizer() -> None:
    assert "0 wrong" in run("step_threads", "tsan", "-pthread")


def test_random_segments_make_their_exact_steps_in_their_exact_time() -> None:
    assert "0 failures" in run("segments_exact", "release")


def test_the_monitor_finds_each_fault_and_nothing_else() -> None:
    assert "0 failures" in run("monitor_finds", "release")
