"""What buses of spindle drives and motor drivers cost in a second: counted here, on MIPS and on Xtensa."""

from __future__ import annotations

import os
import shutil

import mips.count
import pytest
import xtensa_programs.count
from bench.measure import Figure
from bench.traffic import buses, here, on_mips, on_xtensa
from wificnc_chips.esp32 import CPU_HZ, Chip

PART = 0.02  # of a core
PIC32MZ_HZ = 200_000_000
NAMES = [bus.name for bus in buses()]
DRIVE, *DRIVERS = NAMES


def keeps(figures: list[Figure], names: list[str]) -> None:
    assert [figure.name for figure in figures] == names
    assert [figure for figure in figures if not figure.is_met or figure.value <= 0] == []


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("valgrind") is None and "CI" not in os.environ, reason="needs valgrind (apt-get install valgrind)"
)
def test_buses_keep_their_budget_of_instructions() -> None:
    keeps(here(), NAMES)


@pytest.mark.slow
@pytest.mark.skipif(mips.count.not_here() != "", reason=mips.count.not_here())
def test_a_drive_is_at_most_two_per_cent_of_the_pic32mz() -> None:
    figures = on_mips()
    keeps(figures, [DRIVE])
    assert figures[0].value <= PART * PIC32MZ_HZ


@pytest.mark.slow
@pytest.mark.skipif(xtensa_programs.count.not_here() != "", reason=xtensa_programs.count.not_here())
@pytest.mark.parametrize("chip", [Chip.ESP32, Chip.ESP32S3])
def test_a_drive_and_drivers_are_at_most_two_per_cent_of_a_core(chip: Chip) -> None:
    """A board has one bus of drivers: the dearer one counts."""
    figures = on_xtensa(chip)
    keeps(figures, NAMES)
    cost = {figure.name: figure.value for figure in figures}
    assert cost[DRIVE] + max(cost[name] for name in DRIVERS) <= PART * CPU_HZ
