"""The command's own ctypes structures are C's: a missing field is whatever comes after it in memory.

They ship to users who have no compiler, so they are written by hand; here the compiler has the last word.
"""

from __future__ import annotations

from ctypes import Structure

import pytest
import wificnc
from layouts import HOST
from native_layout import (
    assert_called_as_c_wants,
    assert_same_layout,
    c_structure,
    modules_with_structures,
    structures,
)
from wificnc.simulator import library

MODULES = ("wificnc.job.rebuild", "wificnc.simulator.serve.announce", "wificnc.simulator.library")


@pytest.mark.parametrize("ours", structures(MODULES), ids=lambda ours: ours.__name__)
def test_a_structure_is_laid_out_as_in_c(ours: type[Structure]) -> None:
    assert_same_layout(ours, c_structure(ours, [HOST]))


def test_a_function_is_called_as_c_wants_it() -> None:
    assert_called_as_c_wants(library._PROTOTYPES, HOST)


def test_no_module_is_forgotten() -> None:
    assert set(modules_with_structures(wificnc)) == {*MODULES}
