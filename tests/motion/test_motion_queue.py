"""C programs on the core's parts: hand-over between real threads, and segments through prep and the step ISR."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from wificnc.build.host import FLAGS, HEADERS, SYSTEM, VARIANTS, build_program

HERE, ROOT = Path(__file__).parent, checkout_root()


# What crosses threads; all of the controller would be compiled for this one program.
HANDED_OVER = ("base/duty", "step/control", "step/isr", "step/position", "step/prep")


def run(name: str) -> str:
    return said(build_program([HERE / f"{name}.c"], ROOT / "build" / "tests" / name))


def said(program: Path) -> str:
    done = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_batches_and_positions_cross_threads_whole_under_thread_sanitizer(tmp_path: Path) -> None:
    flags = [*FLAGS, *SYSTEM.flags, *VARIANTS["tsan"][0], "-pthread", *(f"-I{ROOT / folder}" for folder in HEADERS)]
    sources = [HERE / "step_threads.c", *(ROOT / "core" / f"{name}.c" for name in HANDED_OVER)]
    sources.append(ROOT / "targets" / "pc" / "trace.c")
    program = tmp_path / "step_threads"
    command = [*locate_compiler(), *flags, *map(str, sources), "-o", str(program), *SYSTEM.libraries]
    subprocess.run(command, check=True, timeout=HANG_S)
    assert "0 wrong" in said(program)


def test_random_segments_make_their_exact_steps_in_their_exact_time() -> None:
    assert "0 failures" in run("segments_exact")


def test_the_monitor_finds_each_fault_and_nothing_else() -> None:
    assert "0 failures" in run("monitor_finds")


def test_the_polls_of_one_instant_come_to_rest() -> None:
    assert "0 failures" in run("ahead_rests")
