"""The core as MIPS code in an emulator: its unit tests pass there, and every step edge is this computer's."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from bench.measure import build_driver as build_here
from everywhere import ROOT, TRACE_DIGEST, UNIT_TESTS, differences, texts
from mips.count import AXES, build_driver
from mips.emulate import PROCESSOR, QEMU, compile_files, controller_sources, link, missing, run
from patience import HANG_S

OUTPUT = ROOT / "build" / "mips" / "qemu"

pytestmark = [
    pytest.mark.skipif(missing() != "", reason=missing()),
    pytest.mark.slow,  # compiles the core for another processor
]


@pytest.fixture(scope="module")
def controller() -> list[Path]:
    return compile_files(ROOT, controller_sources(ROOT), OUTPUT)


def program(controller: list[Path], main: Path) -> Path:
    return link([*controller, *compile_files(ROOT, [main], OUTPUT)], OUTPUT / main.stem)


def test_unit_tests_pass_as_mips_code(controller: list[Path]) -> None:
    assert run(program(controller, UNIT_TESTS), b"", 4 * HANG_S).splitlines() == ["0 failures"]


def test_every_step_edge_and_answer_is_this_computers(controller: list[Path]) -> None:
    assert differences(run(program(controller, TRACE_DIGEST), texts(), 4 * HANG_S)) == []


CORNERS = "G21G90\nG1X10F3000\nX12Y7\nX0Y3\nG2X5Y8I5J0\nG0X0Y0\nG1X-3Y1Z2A4F1200\nX0Y0Z0A0F600\n"


@pytest.mark.parametrize("jerk", [0, 20_000])
def test_four_axes_of_a_chip_make_the_steps_of_six_here(tmp_path: Path, jerk: int) -> None:
    """A vector of four lanes and optimisation for size change no bit of what is planned."""
    job = tmp_path / "job.nc"
    job.write_text(CORNERS)
    traces = []
    for name, argv in {"chip": [QEMU, "-cpu", PROCESSOR, str(build_driver(ROOT))], "here": [str(build_here())]}.items():
        command = [*argv, "-t", str(tmp_path / name), str(AXES), str(job), f"$40={jerk}"]
        subprocess.run(command, check=True, capture_output=True, timeout=4 * HANG_S)
        traces.append((tmp_path / name).read_bytes())
    assert len(traces[0]) > 0 and traces[0] == traces[1]
