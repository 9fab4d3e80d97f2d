"""The core as MIPS code in an emulator: its unit tests pass there, and every step edge is this computer's."""

from __future__ import annotations

from pathlib import Path

import pytest
from everywhere import ROOT, TRACE_DIGEST, UNIT_TESTS, differences, texts
from mips.emulate import compile_files, controller_sources, link, missing, run
from patience import HANG_S

OUTPUT = ROOT / "build" / "mips" / "qemu"

pytestmark = pytest.mark.skipif(missing() != "", reason=missing())


@pytest.fixture(scope="module")
def controller() -> list[Path]:
    return compile_files(ROOT, controller_sources(ROOT), OUTPUT)


def program(controller: list[Path], main: Path) -> Path:
    return link([*controller, *compile_files(ROOT, [main], OUTPUT)], OUTPUT / main.stem)


def test_unit_tests_pass_as_mips_code(controller: list[Path]) -> None:
    assert run(program(controller, UNIT_TESTS), b"", 4 * HANG_S).splitlines() == ["0 failures"]


def test_every_step_edge_and_answer_is_this_computers(controller: list[Path]) -> None:
    assert differences(run(program(controller, TRACE_DIGEST), texts(), 4 * HANG_S)) == []
