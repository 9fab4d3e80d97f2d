"""Clang and LLVM for Xtensa, which all of these tests need."""

from pathlib import Path

import pytest
from on_chip import JOB
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
