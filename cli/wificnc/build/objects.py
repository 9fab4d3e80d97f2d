"""C sources to objects: what is stale, on all processors."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from wificnc.errors import BuildError

OLD = ".old"
ERROR_LINES = 24  # of the compiler's own words in a BuildError


@dataclass(frozen=True)
class Unit:
    """One source and its object."""

    source: Path
    object: Path
    flags: tuple[str, ...] = ()  # of its own, behind those of all

    @property
    def depfile(self) -> Path:
        return self.object.with_suffix(".d")


def compile_stale(
    command: Sequence[str], units: Sequence[Unit], title: str, folder: Path | None = None
) -> tuple[int, str]:
    """Compile what is stale. @param folder  that the compiler runs in, which debug information names
    @return how many, and the compiler's warnings. Raises BuildError."""
    times: dict[str, int] = {}
    stale = [unit for unit in units if _is_stale(unit, times)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda unit: _compile(command, unit, folder), stale))
    failed = [text for ok, text in results if not ok]
    if failed:
        raise failure(f"{len(failed)} of {len(units)} files did not compile ({title})", "\n".join(failed))
    return len(stale), "".join(text for _, text in results)


def is_older(output: Path, inputs: Sequence[Path]) -> bool:
    """Whether the output is missing, or any input is newer."""
    if not output.exists():
        return True
    built_ns = output.stat().st_mtime_ns
    return any(path.stat().st_mtime_ns > built_ns for path in inputs)


def put_in_place(fresh: Path, output: Path) -> None:
    """Move a linked file there; whoever has the old one loaded keeps it. Windows refuses to replace such a file, but
    renames it: then it goes with a later build."""
    for old in output.parent.glob(f".{output.name}.*{OLD}"):
        with suppress(OSError):
            old.unlink()
    try:
        os.replace(fresh, output)
    except PermissionError:
        os.replace(output, output.with_name(f".{output.name}.{os.getpid()}{OLD}"))
        os.replace(fresh, output)


def failure(title: str, said: str) -> BuildError:
    """The compiler's own first words, errors first of all."""
    lines = said.strip().splitlines()
    first = next((n for n, line in enumerate(lines) if "error" in line), 0)
    shown = lines[first : first + ERROR_LINES]
    more = len(lines) - first - len(shown)
    return BuildError("\n".join([title + ":", *shown, *([f"... and {more} more lines"] if more > 0 else [])]))


def _compile(command: Sequence[str], unit: Unit, folder: Path | None) -> tuple[bool, str]:
    """@return whether it went well, and what the compiler said."""
    unit.object.parent.mkdir(parents=True, exist_ok=True)
    begin_ns = time.time_ns()
    argv = [*command, *unit.flags, "-MMD", "-MF", str(unit.depfile), "-c", str(unit.source), "-o", str(unit.object)]
    run = subprocess.run(
        argv, cwd=folder, capture_output=True, text=True, encoding="utf-8", errors="replace", stdin=subprocess.DEVNULL
    )
    if run.returncode != 0:
        unit.object.unlink(missing_ok=True)
        return False, run.stderr
    os.utime(unit.object, ns=(begin_ns, begin_ns))  # a file edited while it was compiled counts as newer
    return True, run.stderr


def _is_stale(unit: Unit, times: dict[str, int]) -> bool:
    """Whether the source or any header it included is newer than the object."""
    try:
        built_ns = unit.object.stat().st_mtime_ns
        words = unit.depfile.read_text(encoding="utf-8").replace("\\\n", " ").replace("\\ ", "\0").split()
        for word in words[1:]:
            name = word.replace("\0", " ")
            if name not in times:
                times[name] = os.stat(name).st_mtime_ns
            if times[name] >= built_ns:
                return True
    except OSError:
        return True
    return False
