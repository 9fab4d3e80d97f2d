"""The host controller: the core, its simulator and its servers (FOLDERS) compiled into one shared library.

A build looks at what changed (compiler, flags, sources, every header a source includes) and compiles just that, on all
processors. With nothing to do it costs a few milliseconds, so callers may ask for the library whenever they need it.
"""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import Compiler, compiler_stamp, identify_compiler, locate_compiler
from wificnc.build.frames import LARGER, PC_FACTOR, pc_frame_flags
from wificnc.build.lock import build_lock
from wificnc.build.native import carried_library
from wificnc.build.objects import Unit, compile_stale, failure, is_older, put_in_place
from wificnc.build.platforms import System, sources_of, this_system
from wificnc.errors import BuildError
from wificnc.files.jsonfile import read_json

FOLDERS = ("core", "targets/net", "targets/pc", "targets/sim")  # sources
HEADERS = (*FOLDERS, "targets/chip")  # where headers are looked for; of the last one: task_periods.h

# psabi: motion/vec.h passes vectors only to functions that are inlined
RAM_BUDGET_BYTES = 192 * 1024  # of one controller; the chips with the same look-ahead have 512 KB
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wno-psabi")

# -ffp-contract=off: the same bits on every target. -fno-math-errno: sqrtf is one instruction; no one reads errno.
FLAGS = ("-std=c11", "-g", "-ffp-contract=off", "-fno-math-errno", *WARNINGS)

# variant -> (compile flags, link flags)
VARIANTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "release": (("-O2",), ()),
    "debug": (("-O1", "-fno-omit-frame-pointer", "-DWIFICNC_DEBUG=7"), ()),  # all debug channels, core/base/debug.h
    "asan": (
        # gcc's shift checks make it see sign conversions that are not there; the release variant warns of the real ones
        (
            "-Og",  # compiles in two thirds of the time of -O1
            "-g1",  # the lines that reports name; `debug` has variables
            "-fno-omit-frame-pointer",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=undefined",
            "-Wno-sign-conversion",
        ),
        ("-fsanitize=address,undefined",),
    ),
    "tsan": (("-O1", "-fno-omit-frame-pointer", "-fsanitize=thread"), ("-fsanitize=thread",)),
}

SANITIZED = ("asan", "tsan")  # their frames are many times as large (frames.py)

SYSTEM = this_system()
LIBRARY_NAME = SYSTEM.library


@dataclass(frozen=True)
class HostBuild:
    """What a build did."""

    library: Path
    compiler: Compiler
    sources: int
    compiled: int
    seconds: float
    warnings: str


def ensure_host_library(variant: str = "release") -> Path:
    """The path of the host library: the wheel's, or built when stale. Raises BuildError."""
    carried = carried_library() if variant == "release" else None
    return carried or build_host(variant).library


def build_host(variant: str = "release", *, root: Path | None = None) -> HostBuild:
    """Bring the host library up to date; variant is one of VARIANTS. Raises BuildError."""
    begin = time.perf_counter()
    root = root or checkout_root()
    directory = variant_directory(root, variant)
    library = directory / LIBRARY_NAME
    with build_lock(directory):
        compiler = _compiler(directory, variant)
        units = _units_of(root, directory, variant, compiler)
        compiled, warnings = _compile_stale(root, compiler, variant, units)
        objects = [unit.object for unit in units]
        if compiled or is_older(library, objects) or _listed(directory) != [str(path) for path in objects]:
            _link(compiler, ["-shared", *SYSTEM.link_flags, *VARIANTS[variant][1]], objects, library)
            (directory / "objects.json").write_text(json.dumps([str(path) for path in objects]), encoding="utf-8")
    return HostBuild(library, compiler, len(units), compiled, time.perf_counter() - begin, warnings)


def core_ram_bytes(library: Path) -> int:
    """Static RAM of one controller: struct machine with all its buffers. Raises BuildError."""
    try:
        function = ctypes.CDLL(str(library)).host_core_ram_bytes
    except (OSError, AttributeError) as err:
        raise BuildError(f"{library.name} cannot be used: {err}") from err
    function.restype = ctypes.c_size_t
    return int(function())


def build_program(
    sources: Sequence[Path],
    output: Path,
    variant: str = "release",
    flags: Sequence[str] = (),
    parts: Collection[Path] | None = None,
) -> Path:
    """Link C sources with the host controller's objects into a program, for tests and benchmarks. Raises BuildError.
    @param parts  the library's sources that it needs, where the others are not to be compiled"""
    root = checkout_root()
    compiler, objects = _objects(root, variant, parts)
    output.parent.mkdir(parents=True, exist_ok=True)
    if is_older(output, [*sources, *objects]):
        options = [*_compile_flags(root, compiler, variant), *flags, *VARIANTS[variant][1]]
        with build_lock(output.parent):
            _link(compiler, [*options, *map(str, sources)], objects, output)
    return output


def _objects(root: Path, variant: str, parts: Collection[Path] | None) -> tuple[Compiler, list[Path]]:
    """Of the library, up to date. @param parts  their sources; None: all"""
    directory = variant_directory(root, variant)
    if parts is None:
        return build_host(variant, root=root).compiler, [unit.object for unit in _units(root, directory)]
    with build_lock(directory):
        compiler = _compiler(directory, variant)
        units = [unit for unit in _units_of(root, directory, variant, compiler) if unit.source in parts]
        _compile_stale(root, compiler, variant, units)
    return compiler, [unit.object for unit in units]


def variant_directory(root: Path, variant: str) -> Path:
    """build/host, and one directory under it for each other variant."""
    if variant not in VARIANTS:
        raise BuildError(f"unknown variant {variant!r}", hint=f"one of: {', '.join(VARIANTS)}")
    base = root / "build" / "host"
    return base if variant == "release" else base / variant


def host_sources(root: Path, system: System = SYSTEM) -> list[Path]:
    """Every C file of the library: all of FOLDERS that this system compiles, but no main()."""
    found = [path for folder in FOLDERS for path in (root / folder).rglob("*.c")]
    return sorted(path for path in sources_of(system, found) if path.name != "main.c")


def _units_of(root: Path, directory: Path, variant: str, compiler: Compiler) -> list[Unit]:
    return _units(root, directory, family=None if variant in SANITIZED else compiler.family)


def _units(root: Path, directory: Path, family: str | None = None) -> list[Unit]:
    """Every source and its object. @param family  of the compiler that bounds stack frames; None: nothing does"""
    return [
        Unit(
            source,
            directory / "obj" / source.relative_to(root).with_suffix(".o"),
            pc_frame_flags(source, root, family=family or ""),
        )
        for source in host_sources(root)
    ]


def _compiler(directory: Path, variant: str) -> Compiler:
    """The compiler, asked who it is only when it or the flags changed; then all objects are stale."""
    argv = locate_compiler()
    stamp_file = directory / "compiler.json"
    stamp = {
        "compiler": compiler_stamp(argv),
        "flags": [*FLAGS, *SYSTEM.flags, *VARIANTS[variant][0], *SYSTEM.link_flags],
        "frames": [{name: bytes_max for name, (bytes_max, _) in LARGER.items()}, PC_FACTOR],
    }
    stored = _load_json(stamp_file)
    if isinstance(stored, dict) and stored.get("stamp") == stamp:
        return Compiler(argv, stored["family"], stored["version"])
    compiler = identify_compiler(argv)
    shutil.rmtree(directory / "obj", ignore_errors=True)
    stamp_file.write_text(
        json.dumps({"stamp": stamp, "family": compiler.family, "version": compiler.version}), encoding="utf-8"
    )
    return compiler


def _compile_flags(root: Path, compiler: Compiler, variant: str) -> list[str]:
    strict = ["-Werror"] if compiler.is_known_clean else []
    return [*FLAGS, *SYSTEM.flags, *VARIANTS[variant][0], *strict, *(f"-I{root / folder}" for folder in HEADERS)]


def _compile_stale(root: Path, compiler: Compiler, variant: str, units: Sequence[Unit]) -> tuple[int, str]:
    return compile_stale([*compiler.argv, *_compile_flags(root, compiler, variant)], units, compiler.title)


def _listed(directory: Path) -> object:
    return _load_json(directory / "objects.json")


def _load_json(path: Path) -> object:
    try:
        return read_json(path)
    except (OSError, ValueError):
        return None


def _link(compiler: Compiler, options: Sequence[str], objects: Sequence[Path], output: Path) -> None:
    """Link next to the output, then move it there: whoever has the old file loaded keeps it."""
    fresh = output.with_name(f".{output.name}.new")
    command = [*compiler.argv, *options, *map(str, objects), "-o", str(fresh), *SYSTEM.libraries]
    run = subprocess.run(
        command, capture_output=True, text=True, encoding="utf-8", errors="replace", stdin=subprocess.DEVNULL
    )
    if run.returncode != 0:
        raise failure(f"{output.name} did not link ({compiler.title})", run.stderr)
    put_in_place(fresh, output)
