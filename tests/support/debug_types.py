"""Structures and enumerations in the debug information (DWARF) of an object file, as plain lists and dictionaries.

A type is one of ["integer", bytes, is signed], ["float", bytes], ["bool"], ["char"], ["void"], ["vector"],
["array", type, count], ["pointer", type, to const], ["struct", name], ["function", result, parameters]. A structure
without a name is named after its place in the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from elftools.dwarf.die import DIE
from elftools.elf.elffile import ELFFile

STRUCTS = ("DW_TAG_structure_type", "DW_TAG_union_type")
THROUGH = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type", "DW_TAG_atomic_type", "DW_TAG_restrict_type")
BOOLEAN, FLOAT, SIGNED, SIGNED_CHAR, UNSIGNED, UNSIGNED_CHAR = 2, 4, 5, 6, 7, 8  # DW_ATE_...


def read_types(path: Path) -> dict[str, Any]:
    """{"structs": {name: {"size", "union", "fields": [{"name", "at", "type"}]}}, "enums": {name: {name: value}},
    "variables": {name: type}}.
    """
    found: dict[str, dict[str, Any]] = {"structs": {}, "enums": {}, "variables": {}}
    with path.open("rb") as stream:
        for unit in ELFFile(stream).get_dwarf_info().iter_CUs():
            for entry in unit.iter_DIEs():
                if entry.tag in STRUCTS and "DW_AT_byte_size" in entry.attributes:
                    found["structs"][_name(entry)] = {
                        "size": _number(entry, "DW_AT_byte_size"),
                        "union": entry.tag == "DW_TAG_union_type",
                        "fields": [_field(row) for row in _children(entry, "DW_TAG_member")],
                    }
                elif entry.tag == "DW_TAG_enumeration_type":
                    values = _children(entry, "DW_TAG_enumerator")
                    found["enums"][_name(entry)] = {_name(row): _number(row, "DW_AT_const_value") for row in values}
                elif entry.tag == "DW_TAG_variable" and "DW_AT_name" in entry.attributes:
                    found["variables"][_name(entry)] = _type(entry)
    return found


def _name(entry: DIE) -> str:
    attribute = entry.attributes.get("DW_AT_name")
    return attribute.value.decode() if attribute else f"@{entry.offset}"


def _number(entry: DIE, attribute: str) -> int:
    return int(entry.attributes[attribute].value)


def _children(entry: DIE, tag: str) -> Iterator[DIE]:
    return (child for child in entry.iter_children() if child.tag == tag)


def _field(entry: DIE) -> dict[str, Any]:
    row: dict[str, Any] = {"name": _name(entry), "at": 0, "type": _type(entry)}
    if "DW_AT_data_member_location" in entry.attributes:
        row["at"] = _number(entry, "DW_AT_data_member_location")
    if "DW_AT_bit_size" in entry.attributes:
        row["bits"] = _number(entry, "DW_AT_bit_size")
    return row


def _type(entry: DIE) -> list[Any]:
    """That of a variable, a field, a parameter or a pointer."""
    if "DW_AT_type" not in entry.attributes:
        return ["void"]
    found = entry.get_DIE_from_attribute("DW_AT_type")
    if found.tag in THROUGH:
        return _type(found)
    if found.tag in STRUCTS:
        return ["struct", _name(found)]
    if found.tag == "DW_TAG_base_type":
        return _base(found)
    if found.tag == "DW_TAG_enumeration_type":
        return _enumeration(found)
    if found.tag == "DW_TAG_pointer_type":
        return ["pointer", _type(found), _is_const(found)]
    if found.tag == "DW_TAG_subroutine_type":
        return ["function", _type(found), [_type(row) for row in _children(found, "DW_TAG_formal_parameter")]]
    assert found.tag == "DW_TAG_array_type", f"{found.tag} of {_name(entry)}"
    if "DW_AT_GNU_vector" in found.attributes:
        return ["vector"]
    made = _type(found)
    for row in reversed(list(_children(found, "DW_TAG_subrange_type"))):
        made = ["array", made, _count(row)]
    return made


def _is_const(pointer: DIE) -> bool:
    return (
        "DW_AT_type" in pointer.attributes and pointer.get_DIE_from_attribute("DW_AT_type").tag == "DW_TAG_const_type"
    )


def _base(entry: DIE) -> list[Any]:
    size, encoding = _number(entry, "DW_AT_byte_size"), _number(entry, "DW_AT_encoding")
    if encoding == BOOLEAN:
        return ["bool"]
    if encoding == FLOAT:
        return ["float", size]
    if _name(entry) == "char":
        return ["char"]
    return ["integer", size, encoding in (SIGNED, SIGNED_CHAR)]


def _enumeration(entry: DIE) -> list[Any]:
    """A C enumeration is an int, or an unsigned int; both compare alike with what a test writes."""
    values = [_number(row, "DW_AT_const_value") for row in _children(entry, "DW_TAG_enumerator")]
    return ["integer", _number(entry, "DW_AT_byte_size"), min(values, default=0) < 0]


def _count(entry: DIE) -> int:
    if "DW_AT_count" in entry.attributes:
        return _number(entry, "DW_AT_count")
    return _number(entry, "DW_AT_upper_bound") + 1 if "DW_AT_upper_bound" in entry.attributes else 0
