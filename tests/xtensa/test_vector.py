"""The step interrupt's vector above code with register windows: tests/xtensa/vector."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from patience import HANG_S
from xtensa import windows
from xtensa.headers import small_headers
from xtensa.isr import VECTOR
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent / "vector"
REAL = ("core/step/isr.c", "core/step/control.c", "core/step/position.c", "targets/esp32/hal/step_interrupt.c",
        "targets/chip/gang.c", "targets/chip/step_pins.c")  # fmt: skip
FAULTS = {
    1: "the program under the interrupt computed something else",
    2: "a compare-and-swap of the program was broken",
    3: "the position is not that of the pulses",
    4: "the position at rest is not that of the pulses",
    5: "too few interrupts",
    6: "no interrupt came in a window handler",
}


@pytest.fixture(scope="module")
def tools() -> Toolchain:
    try:
        found = find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
    if said := windows.missing(found):
        pytest.skip(said)
    return found


def outcome(tools: Toolchain, output: Path, vector: Path, seconds: float) -> str:
    headers = small_headers(ROOT, "esp32", output)
    headers = replace(headers, system=(HERE, *headers.system))
    sources = [*(ROOT / name for name in REAL), *HERE.glob("*.c"), *HERE.glob("*.S"), vector]
    try:
        code = windows.run(windows.build(tools, ROOT, headers, sources, output), seconds)
    except subprocess.TimeoutExpired:
        return "does not end"
    return FAULTS.get(code, f"exit code {code}") if code != 0 else "good"


@pytest.mark.slow
def test_the_vector_changes_nothing_wherever_it_comes(tools: Toolchain, tmp_path: Path) -> None:
    assert outcome(tools, tmp_path, ROOT / VECTOR, HANG_S) == "good"


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    ["    wsr.sar a2\n", "    wsr.scompare1 a3\n", "    l32i a11, a1, 44\n"],
)
def test_whatever_the_vector_forgets_is_found(tools: Toolchain, tmp_path: Path, line: str) -> None:
    text = (ROOT / VECTOR).read_text()
    assert line in text
    (tmp_path / "forgets.S").write_text(text.replace(line, ""))
    assert outcome(tools, tmp_path, tmp_path / "forgets.S", HANG_S / 6) != "good"
