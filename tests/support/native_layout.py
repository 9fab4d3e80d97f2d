"""Structures and functions as ctypes has them in our packages, compared with what the compiler has (layouts.py)."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
from collections.abc import Iterator, Sequence
from ctypes import Array, Structure, c_char_p, c_void_p, sizeof
from types import ModuleType
from typing import Any

from layouts import LayoutError, Layouts


def structures(modules: Sequence[str]) -> list[type[Structure]]:
    """All of the modules' own."""
    found = (value for name in modules for value in vars(importlib.import_module(name)).values())
    return [value for value in found if isinstance(value, type) and issubclass(value, Structure) and value != Structure]


def modules_with_structures(package: ModuleType) -> Iterator[str]:
    """Names of all modules of a package that declare one."""
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        source = importlib.util.find_spec(module.name)
        assert source and source.origin
        with open(source.origin, encoding="utf-8") as file:
            if re.search(r"\b_fields_\b", file.read()):
                yield module.name


def c_structure(ours: type[Structure], places: Sequence[Layouts]) -> type[Structure]:
    """That of its docstring."""
    named = re.match(r"struct (\w+)", ours.__doc__ or "")
    assert named, f"{ours.__name__}: its docstring begins with the C structure's name"
    for layouts in places:
        try:
            return layouts.struct(named[1])
        except LayoutError:
            continue
    raise AssertionError(f"{named[0]} is not there any more")


def assert_same_layout(ours: type[Structure], theirs: type[Structure]) -> None:
    """Places and sizes; and each number is read as the kind that it is, signed, unsigned or floating. Of an enumeration
    only the size is C's to choose."""
    assert layout(ours) == layout(theirs)
    kinds = {name: kind for name, kind, *_ in theirs._fields_}
    for name, kind, *_ in ours._fields_:
        assert numbers(kind) == numbers(kinds[name]), name


def assert_called_as_c_wants(prototypes: dict[str, Any], layouts: Layouts) -> None:
    for name, (result, arguments) in prototypes.items():
        their_result, theirs = layouts.prototype(name)
        assert [passed(kind) for kind in arguments] == [passed(kind) for kind in theirs], name
        assert passed(result) == passed(their_result), name


def layout(structure: type[Structure]) -> list[tuple[str, int, int]]:
    """Name, place and size of each field."""
    fields = [(name, getattr(structure, name)) for name, *_ in structure._fields_]
    return [*((name, field.offset, field.size) for name, field in fields), ("all", 0, sizeof(structure))]


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
