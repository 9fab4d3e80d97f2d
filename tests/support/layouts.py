"""C structures, enumerations and prototypes as the compiler sees them: from the debug information of the headers.

A structure becomes a ctypes class when a test asks for it: HOST.struct("gcode_move"). What the compiler said is stored
in build/tests under the hash of all headers, so it is compiled once and is never stale.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from enum import IntEnum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from debug_types import read_types
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import compiler_stamp, locate_compiler
from wificnc.build.host import FOLDERS, HEADERS

# Headers declare more than they use themselves; version 4 is what every pyelftools reads.
FLAGS = ("-std=c11", "-D_POSIX_C_SOURCE=200809L", "-gdwarf-4", "-fno-eliminate-unused-debug-types", "-c")
# Of a header as clang-format leaves it: a prototype begins its line, and `static` is of functions that no library has.
PROTOTYPE = re.compile(r"^(?!static|typedef|extern)\w[\w *]*?\b(\w+)\([^;{}]*\);", re.MULTILINE)
POINTER_PREFIX = "pointer_to_"
NUMBERS: dict[tuple[Any, ...], Any] = {  # of debug_types
    ("integer", 1, True): ctypes.c_int8,
    ("integer", 2, True): ctypes.c_int16,
    ("integer", 4, True): ctypes.c_int32,
    ("integer", 8, True): ctypes.c_int64,
    ("integer", 1, False): ctypes.c_uint8,
    ("integer", 2, False): ctypes.c_uint16,
    ("integer", 4, False): ctypes.c_uint32,
    ("integer", 8, False): ctypes.c_uint64,
    ("float", 4): ctypes.c_float,
    ("float", 8): ctypes.c_double,
    ("bool",): ctypes.c_bool,
    ("char",): ctypes.c_char,
}


class Address(ctypes.c_void_p):
    """A pointer in a call: an address, an array, bytes, byref(), or a structure itself."""

    @classmethod
    def from_param(cls, value: Any) -> Any:
        return ctypes.byref(value) if isinstance(value, ctypes.Structure) else ctypes.c_void_p.from_param(value)


class LayoutError(Exception):
    """A structure that the headers do not have, or that ctypes cannot express."""


def _compiler() -> list[str]:
    """One that writes ELF: on another system than Linux PyPI's zig, for Linux on the same processor."""
    if sys.platform == "linux":
        return list(locate_compiler())
    machine = {"arm64": "aarch64", "AMD64": "x86_64"}.get(platform.machine(), platform.machine())
    return [sys.executable, "-m", "ziglang", "cc", "-target", f"{machine}-linux-musl"]


class Layouts:
    """The structures of all headers in some folders, and where those look for headers."""

    def __init__(self, name: str, folders: Sequence[str], includes: Sequence[str]) -> None:
        self._name, self._folders, self._includes = name, folders, includes
        self._made: dict[str, type[ctypes.Structure]] = {}

    def struct(self, name: str) -> type[Any]:
        """The ctypes class of `struct name`, whose fields are C's. Raises LayoutError."""
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def enum(self, name: str) -> type[IntEnum]:
        """`enum name`, in the order of its declaration. Raises LayoutError."""
        return IntEnum(name, self._found("enums", name))

    def record(self, name: str, **shorter: str) -> np.dtype[np.void]:
        """The numpy record of `struct name`. @param shorter  fields that have another name in the record"""
        made = np.dtype(self.struct(name))
        made.names = tuple(shorter.get(field, field) for field in made.names or ())
        return made

    def functions(self) -> list[str]:
        """All that a header declares."""
        found = (name.partition(POINTER_PREFIX)[2] for name in self._types["variables"])
        return [name for name in found if name]

    def prototype(self, function: str) -> tuple[Any, list[Any]]:
        """Result and parameters of a function. Raises LayoutError."""
        _, result, parameters = self._found("variables", POINTER_PREFIX + function)[1]
        kinds = [self._parameter(described) for described in parameters]
        return self._parameter(result), [Address if kind is ctypes.c_void_p else kind for kind in kinds]

    def field_names(self, name: str) -> list[str]:
        """Those of `struct name`, in order. Raises LayoutError."""
        return [row["name"] for row in self._found("structs", name)["fields"]]

    @cached_property
    def _types(self) -> dict[str, dict[str, Any]]:
        root = checkout_root()
        argv = _compiler()
        headers, read = _headers(root, self._folders), _headers(root, {*self._folders, *self._includes})
        known = hashlib.sha256(json.dumps([compiler_stamp(tuple(argv)), FLAGS, self._includes]).encode())
        for path in (Path(__file__), Path(__file__).with_name("debug_types.py"), *read):
            known.update(f"\n{path}\n".encode() + path.read_bytes())
        stored = root / "build" / "tests" / f"layouts-{self._name}-{known.hexdigest()[:16]}.json"
        if not stored.is_file():
            stored.parent.mkdir(parents=True, exist_ok=True)
            _store(stored, _compile([*argv, *FLAGS, *(f"-I{root / folder}" for folder in self._includes)], headers))
        types: dict[str, dict[str, Any]] = json.loads(stored.read_text())
        return types

    def _found(self, kind: str, name: str) -> Any:
        try:
            return self._types[kind][name]
        except KeyError:
            raise LayoutError(f"no header of {', '.join(self._folders)} has one of the {kind} named {name}") from None

    def _make(self, name: str) -> type[ctypes.Structure]:
        found = self._found("structs", name)
        base = ctypes.Union if found["union"] else ctypes.Structure
        made: type[Any] = type(name, (base,), {"__doc__": f"struct {name}", "__slots__": ()})  # no other attributes
        self._made[name] = made  # a pointer in it may lead back to it
        try:
            made._fields_ = [self._field(row) for row in found["fields"]]
        except LayoutError:
            del self._made[name]
            raise
        offsets = [getattr(made, row["name"]).offset for row in found["fields"] if "bits" not in row]
        if (offsets, ctypes.sizeof(made)) != ([r["at"] for r in found["fields"] if "bits" not in r], found["size"]):
            raise LayoutError(f"struct {name}: ctypes lays it out in another way than C")
        return made

    def _field(self, row: dict[str, Any]) -> tuple[Any, ...]:
        kind = self._ctype(row["type"])
        return (row["name"], kind, row["bits"]) if "bits" in row else (row["name"], kind)

    def _ctype(self, described: Sequence[Any]) -> Any:
        """Of a type as debug_types describes it."""
        kind, *rest = described
        if kind == "array":
            return self._ctype(rest[0]) * rest[1]
        if kind == "struct":
            return self.struct(rest[0])
        if kind == "pointer":
            return ctypes.c_char_p if rest == [["char"], True] else self._pointer(rest[0])
        if tuple(described) not in NUMBERS:
            raise LayoutError(f"ctypes has no {described}")
        return NUMBERS[tuple(described)]

    def _parameter(self, described: Sequence[Any]) -> Any:
        """Of a parameter or a result."""
        if described == ["void"]:
            return None
        if described[0] != "pointer":
            return self._ctype(described)
        if described[1][0] == "function":
            return self._pointer(described[1])
        return ctypes.c_char_p if described[1] == ["char"] else ctypes.c_void_p

    def _pointer(self, to: Sequence[Any]) -> Any:
        if to[0] == "function":
            return ctypes.CFUNCTYPE(self._parameter(to[1]), *map(self._parameter, to[2]))
        if to[0] in ("void", "vector") or (to[0] == "struct" and to[1] not in self._types["structs"]):
            return ctypes.c_void_p
        return ctypes.POINTER(self._ctype(to))


def _headers(root: Path, folders: Iterable[str]) -> list[Path]:
    return sorted(path for folder in folders for path in (root / folder).rglob("*.h"))


def _compile(command: list[str], headers: Sequence[Path]) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as scratch:
        source, object_file = Path(scratch, "headers.c"), Path(scratch, "headers.o")
        lines = [f'#include "{path}"' for path in headers]
        names = {name for path in headers for name in PROTOTYPE.findall(path.read_text(encoding="utf-8"))}
        lines += [f"__typeof__({name}) *{POINTER_PREFIX}{name};" for name in sorted(names)]
        source.write_text("\n".join(lines) + "\n")
        subprocess.run([*command, str(source), "-o", str(object_file)], check=True)
        return read_types(object_file)


def _store(path: Path, types: dict[str, Any]) -> None:
    """Whole or not at all: several workers may do it at the same time."""
    unfinished = path.with_suffix(f".{os.getpid()}")
    unfinished.write_text(json.dumps(types))
    unfinished.replace(path)


HOST = Layouts("host", FOLDERS, HEADERS)
LINUXCNC = Layouts("linuxcnc", ["linuxcnc"], ["linuxcnc", "core"])
