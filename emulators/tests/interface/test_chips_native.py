"""The ctypes structures of the virtual chips are C's, as those of the command are (tests/sim/test_sim_native.py)."""

from __future__ import annotations

from ctypes import Structure
from typing import Any

import pytest
import wificnc_chips
from layouts import Layouts
from native_layout import (
    assert_called_as_c_wants,
    assert_same_layout,
    c_structure,
    modules_with_structures,
    structures,
)
from wificnc_chips.esp32 import chip as esp32
from wificnc_chips.pic32mz import chip as pic32mz

FOREIGN = ("wificnc_chips.slirp",)  # libslirp's: tests of espsim run it, and its headers are not here
MODULES = ("wificnc_chips.pic32mz.chip", "wificnc_chips.esp32.chip")
SOURCES = {name: f"emulators/wificnc_chips/{name}" for name in ("mzsim", "espsim")}
MZSIM, ESPSIM = (Layouts(name, [folder], [folder]) for name, folder in SOURCES.items())


@pytest.mark.parametrize(
    "ours", structures(MODULES), ids=lambda ours: f"{ours.__module__.split('.')[1]}-{ours.__name__}"
)
def test_a_structure_is_laid_out_as_in_c(ours: type[Structure]) -> None:
    assert_same_layout(ours, c_structure(ours, [MZSIM, ESPSIM]))


@pytest.mark.parametrize(
    ("prototypes", "layouts"),
    [(pic32mz.PROTOTYPES, MZSIM), (esp32.PROTOTYPES, ESPSIM)],
    ids=["pic32mz", "esp32"],
)
def test_a_function_is_called_as_c_wants_it(prototypes: dict[str, Any], layouts: Layouts) -> None:
    assert_called_as_c_wants(prototypes, layouts)


def test_no_module_is_forgotten() -> None:
    assert set(modules_with_structures(wificnc_chips)) == {*MODULES, *FOREIGN}
