"""The command's own ctypes structures are C's: a missing field is whatever comes after it in memory.

They ship to users who have no compiler, so they are written by hand; here the compiler has the last word.
"""

from __future__ import annotations

import importlib.util
import pkgutil
import re
from ctypes import Array, Structure, c_char_p, c_void_p, sizeof
from typing import Any

import pytest
import wificnc
from layouts import HOST, VIRTUAL_CHIP, VIRTUAL_ESP32, LayoutError, Layouts
from wificnc.chip import espsim as esp32
from wificnc.chip import virtual
from wificnc.sim import native

FOREIGN = ("wificnc.chip.slirp",)  # libslirp's: tests/espsim runs it, and its headers are not here
MODULES = ("wificnc.job.native", "wificnc.sim.native", "wificnc.chip.virtual", "wificnc.chip.espsim")


def structures() -> list[type[Structure]]:
    """All of the modules' own."""
    found = (value for name in MODULES for value in vars(importlib.import_module(name)).values())
    return [value for value in found if isinstance(value, type) and issubclass(value, Structure) and value != Structure]


def c_structure(ours: type[Structure]) -> type[Structure]:
    """That of its docstring."""
    named = re.match(r"struct (\w+)", ours.__doc__ or "")
    assert named, f"{ours.__name__}: its docstring begins with the C structure's name"
    for layouts in (HOST, VIRTUAL_CHIP, VIRTUAL_ESP32):
        try:
            return layouts.struct(named[1])
        except LayoutError:
            continue
    raise AssertionError(f"{named[0]} is not there any more")


def layout(structure: type[Structure]) -> list[tuple[str, int, int]]:
    """Name, place and size of each field."""
    fields = [(name, getattr(structure, name)) for name, *_ in structure._fields_]
    return [*((name, field.offset, field.size) for name, field in fields), ("all", 0, sizeof(structure))]


@pytest.mark.parametrize("ours", structures(), ids=lambda ours: ours.__name__)
def test_a_structure_is_laid_out_as_in_c(ours: type[Structure]) -> None:
    assert layout(ours) == layout(c_structure(ours))


@pytest.mark.parametrize("ours", structures(), ids=lambda ours: ours.__name__)
def test_a_number_is_read_as_the_kind_it_is(ours: type[Structure]) -> None:
    """Signed, unsigned or floating; of an enumeration only the size is C's to choose."""
    theirs = {name: kind for name, kind, *_ in c_structure(ours)._fields_}
    for name, kind, *_ in ours._fields_:
        assert numbers(kind) == numbers(theirs[name]), name


def numbers(kind: type) -> object:
    """A type as the struct module writes it; those of the same meaning alike."""
    length = getattr(kind, "_length_", None)
    if length is not None:
        return length, numbers(kind._type_)
    letter = getattr(kind, "_type_", None)
    return {"l": "q", "L": "Q", "P": "pointer"}.get(letter, letter) if isinstance(letter, str) else sizeof(kind)


def passed(kind: Any) -> object:
    """How it is passed. Pointers are alike, and so are integers of a size, signed or not: enumerations are either."""
    if kind is None or issubclass(kind, Structure):
        return kind and sizeof(kind)
    is_pointer = issubclass(kind, (Array, c_void_p, c_char_p)) or hasattr(kind, "contents")
    return "pointer" if is_pointer else (numbers(kind) in ("f", "d"), sizeof(kind))


@pytest.mark.parametrize(
    ("prototypes", "layouts"),
    [(native._PROTOTYPES, HOST), (virtual._PROTOTYPES, VIRTUAL_CHIP), (esp32.PROTOTYPES, VIRTUAL_ESP32)],
    ids=["sim", "chip", "esp32"],
)
def test_a_function_is_called_as_c_wants_it(prototypes: dict[str, Any], layouts: Layouts) -> None:
    for name, (result, arguments) in prototypes.items():
        their_result, theirs = layouts.prototype(name)
        assert [passed(kind) for kind in arguments] == [passed(kind) for kind in theirs], name
        assert passed(result) == passed(their_result), name


def test_no_module_is_forgotten() -> None:
    for module in pkgutil.walk_packages(wificnc.__path__, "wificnc."):
        source = importlib.util.find_spec(module.name)
        assert source and source.origin
        with open(source.origin, encoding="utf-8") as file:
            assert bool(re.search(r"\b_fields_\b", file.read())) == (module.name in (*MODULES, *FOREIGN)), module.name
