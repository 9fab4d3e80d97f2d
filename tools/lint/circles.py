"""Files of the core that call each other in a circle: what one of them does can be understood only with all of them.
And files of the core that no firmware calls.

Measured on object files: a file calls those that define what it leaves open. Inlined functions are their callers'.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from threading import Lock

import networkx
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection
from wificnc.build.compiler import locate_compiler

from lint.external import INCLUDE_PATHS
from lint.problem import Problem, source_files

LARGEST = 2
FIRMWARE = ("targets/chip/", "targets/net/", "targets/esp32/", "targets/pic32mz/")
WORD = re.compile(r"\w+")
COMPILED_ONLY = Path("core/hal/contract.c")  # checks signatures
LOCK = Lock()

Core = dict[Path, tuple[set[str], set[str]]]


def check_circles(root: Path) -> list[Problem]:
    """Circles of more than LARGEST files."""
    try:
        calls = _calls(_core(root))
    except (OSError, subprocess.CalledProcessError) as error:
        return [Problem(Path("core"), 0, f"cannot compile the core: {error}")]
    circles = sorted(sorted(circle) for circle in networkx.strongly_connected_components(calls))
    return [
        Problem(circle[0], 1, f"these {len(circle)} files call each other in a circle: {', '.join(map(str, circle))}")
        for circle in circles
        if len(circle) > LARGEST
    ]


def check_firmware(root: Path) -> list[Problem]:
    """Files of the core that no firmware gets to, by what its own files name."""
    try:
        symbols = _core(root)
    except (OSError, subprocess.CalledProcessError):
        return []  # check_circles() reports it
    calls = _calls(symbols)
    sources = [path for path in source_files(root, ".c", ".h", ".S") if str(path).startswith(FIRMWARE)]
    words = {word for path in sources for word in WORD.findall((root / path).read_text())}
    reached = {path for path, (defined, _) in symbols.items() if defined & words}
    for path in list(reached):
        reached |= networkx.descendants(calls, path)
    idle = sorted(path for path, (defined, _) in symbols.items() if defined and path not in (*reached, COMPILED_ONLY))
    return [Problem(path, 1, "no firmware calls this file: it belongs to targets/pc or targets/sim") for path in idle]


def _calls(symbols: Core) -> networkx.DiGraph[Path]:
    """Which file calls which."""
    home = {name: path for path, (defined, _) in symbols.items() for name in defined}
    calls: networkx.DiGraph[Path] = networkx.DiGraph()
    calls.add_nodes_from(symbols)
    calls.add_edges_from((path, home[name]) for path, (_, wanted) in symbols.items() for name in wanted if name in home)
    return calls


def _core(root: Path) -> Core:
    """Every file of the core: names that it defines for others, and names that it wants of others."""
    with LOCK:  # lints run side by side, and one compilation is for both
        return _compiled_core(root)


@cache
def _compiled_core(root: Path) -> Core:
    sources = [path for path in source_files(root, ".c") if path.parts[0] == "core"]
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor() as pool:
        read = pool.map(lambda path: _symbols(root, path, Path(scratch)), sources)
        return dict(zip(sources, read, strict=True))


def _symbols(root: Path, source: Path, scratch: Path) -> tuple[set[str], set[str]]:
    """Names that this file defines for others, and names that it wants of others."""
    output = scratch / f"{'_'.join(source.with_suffix('').parts)}.o"
    paths = [f"-I{path}" for path in INCLUDE_PATHS]
    argv = [*locate_compiler(), "-std=c11", "-w", "-O0", *paths, "-c", str(source), "-o", str(output)]
    subprocess.run(argv, cwd=root, check=True, capture_output=True)
    defined: set[str] = set()
    wanted: set[str] = set()
    with output.open("rb") as stream:
        table = ELFFile(stream).get_section_by_name(".symtab")
        for symbol in table.iter_symbols() if isinstance(table, SymbolTableSection) else ():
            if symbol.name and symbol["st_info"]["bind"] != "STB_LOCAL":
                (wanted if symbol["st_shndx"] == "SHN_UNDEF" else defined).add(symbol.name)
    return defined, wanted
