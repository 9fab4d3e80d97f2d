"""The virtual chips in C (mzsim/, espsim/), each compiled into one shared library."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

from wificnc.build.checkout import checkout_root, find_checkout
from wificnc.build.compiler import Compiler, compiler_stamp, identify_compiler, locate_compiler
from wificnc.build.host import LIBRARY_NAME, WARNINGS
from wificnc.build.lock import build_lock
from wificnc.build.objects import Unit, compile_stale, failure, is_older, put_in_place
from wificnc.files.jsonfile import read_json

HERE = Path(__file__).resolve().parent
# What a virtual chip shares with the firmware, whose sources are the command's.
SHARED = {"espsim": ("core/base/sha256.c",)}
FLAGS = ("-std=c11", "-O2", "-g", "-fPIC", "-fvisibility=default", "-ffp-contract=off", "-fno-math-errno", *WARNINGS)


def ensure_chip_library(name: str) -> Path:
    """The path of the library, built when stale. Raises BuildError. @param name  of its folder here"""
    root = checkout_root()
    directory = root / "build" / _folder(name)
    library = directory / LIBRARY_NAME.replace("wificnc", name)
    with build_lock(directory):
        compiler = _compiler(directory)
        sources = [*sorted((HERE / name).glob("*.c")), *(root / path for path in SHARED.get(name, ()))]
        units = [Unit(source, directory / "obj" / f"{source.stem}.o") for source in sources]
        strict = ["-Werror"] if compiler.is_known_clean else []
        compiled, _ = compile_stale([*compiler.argv, *FLAGS, *strict, f"-I{root / 'core'}"], units, compiler.title)
        objects = [unit.object for unit in units]
        if compiled or is_older(library, objects):
            _link(compiler, objects, library)
    return library


def _folder(name: str) -> str:
    """Of what is built. An installed package's files have any time, so other sources have another folder."""
    if find_checkout() is not None:
        return name
    digest = hashlib.sha256()
    for file in sorted(path for path in (HERE / name).rglob("*") if path.is_file()):
        digest.update(f"{file.relative_to(HERE).as_posix()}\0{file.stat().st_size}\0".encode())
        digest.update(file.read_bytes())
    return f"{name}-{digest.hexdigest()[:12]}"


def _compiler(directory: Path) -> Compiler:
    """The computer's own compiler, asked who it is only when it or the flags changed; then all objects are stale."""
    argv = locate_compiler()
    stamp_file = directory / "compiler.json"
    stamp = [compiler_stamp(argv), *FLAGS]
    try:
        stored = read_json(stamp_file)
        if stored["stamp"] == stamp:
            return Compiler(argv, stored["family"], stored["version"])
    except (OSError, ValueError, TypeError, KeyError):
        pass  # missing, or written by an older release
    compiler = identify_compiler(argv)
    for stale in (directory / "obj").glob("*.o"):
        stale.unlink()
    stored = {"stamp": stamp, "family": compiler.family, "version": compiler.version}
    stamp_file.write_text(json.dumps(stored), encoding="utf-8")
    return compiler


def _link(compiler: Compiler, objects: list[Path], library: Path) -> None:
    """Next to the library, then over it: whoever has the old one loaded keeps it."""
    fresh = library.with_name(f".{library.name}.new")
    own_names_first = ["-Wl,-Bsymbolic"] if sys.platform == "linux" else []
    command = [*compiler.argv, "-shared", *own_names_first, *map(str, objects), "-o", str(fresh), "-lm"]
    run = subprocess.run(
        command, capture_output=True, text=True, encoding="utf-8", errors="replace", stdin=subprocess.DEVNULL
    )
    if run.returncode != 0:
        raise failure(f"{library.name} did not link ({compiler.title})", run.stderr)
    put_in_place(fresh, library)
