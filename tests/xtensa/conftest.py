"""Clang and LLVM for Xtensa, which all of these tests need."""

import pytest
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain


@pytest.fixture(scope="module")
def tools() -> Toolchain:
    try:
        return find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))
