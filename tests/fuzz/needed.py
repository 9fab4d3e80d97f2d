"""Which files of the host library a program in C needs, by the symbols of compiled files: to compile only these with
sanitizers."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from wificnc.build.host import HEADERS, build_host, host_sources, variant_directory


def needed_parts(sources: Sequence[Path], flags: Sequence[str], folder: Path) -> set[Path] | None:
    """Sources of the library; None where objects are no ELF files: all. @param folder  for objects of the program"""
    if sys.platform != "linux":
        return None
    objects, homes = _library()
    found: set[Path] = set()
    todo = [_compiled(source, flags, folder) for source in sources]
    while todo:
        more = {homes[name] for name in symbols(todo.pop())[1] if name in homes} - found
        found |= more
        todo += [objects[source] for source in more]
    return found


def _compiled(source: Path, flags: Sequence[str], folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    made, includes = folder / f"{source.stem}.o", [f"-I{checkout_root() / name}" for name in HEADERS]
    subprocess.run([*locate_compiler(), "-std=c11", *flags, *includes, "-c", str(source), "-o", str(made)], check=True)
    return made


@cache
def _library() -> tuple[dict[Path, Path], dict[str, Path]]:
    """Objects by their sources, and sources by the symbols that they define."""
    root = checkout_root()
    build_host(root=root)
    folder = variant_directory(root, "release") / "obj"
    objects = {source: folder / source.relative_to(root).with_suffix(".o") for source in host_sources(root)}
    return objects, {name: source for source, path in objects.items() for name in symbols(path)[0]}


def symbols(path: Path) -> tuple[set[str], set[str]]:
    """Those that an object defines for others, and those that it asks for."""
    with path.open("rb") as file:
        (table,) = ELFFile(file).iter_sections("SHT_SYMTAB")
        assert isinstance(table, SymbolTableSection)
        rows = [each for each in table.iter_symbols() if each["st_info"]["bind"] != "STB_LOCAL"]
    asked = {each.name for each in rows if each["st_shndx"] == "SHN_UNDEF"}
    return {each.name for each in rows} - asked, asked
