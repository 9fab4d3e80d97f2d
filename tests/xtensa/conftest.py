"""Clang and LLVM for Xtensa, which all of these tests need."""

from pathlib import Path

import pytest
from on_chip import JOB
from wificnc_chips.esp32 import Chip, VirtualChip
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain


@pytest.fixture(scope="module")
def tools() -> Toolchain:
    try:
        return find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.nc"
    path.write_text(JOB)
    return path


@pytest.fixture
def cycle_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cycle for each instruction: the tests' program has both sides on one core, so with the costs of the caches its
    motion side would come late, which a board's does not."""
    create = VirtualChip.__init__

    def init(chip: VirtualChip, kind: Chip = Chip.ESP32) -> None:
        create(chip, kind)
        chip.timing(False)

    monkeypatch.setattr(VirtualChip, "__init__", init)
