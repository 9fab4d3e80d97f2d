"""No structure of the core above MAX_BYTES is assigned, passed or returned by value.

A compiler may build such a value on the stack before it copies it: `*step = (struct step){.hal = hal}` was 43 KB there
with one compiler and nothing with another. In code without optimisation each of them is a call of llvm.memcpy; those
that were written as memcpy() stay calls of that name.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from wificnc.build.cross import zig_cc
from wificnc.build.host import HEADERS
from wificnc.errors import BuildError

from lint.problem import Problem, source_files

MAX_BYTES = 256

FLAGS = ("-std=c11", "-g1", "-O0", "-fno-builtin", "-w", "-S", "-emit-llvm", "-o", "-")
COPY = re.compile(r"@llvm\.memcpy\.[^(]*\([^\n]*?i64 (\d+), i1 \w+\)[^\n]*?!dbg (!\d+)")
PLACE = re.compile(r"^(!\d+) = !DILocation\(line: (\d+)", re.MULTILINE)


def check_copies(root: Path) -> list[Problem]:
    """By clang, this machine's or the one of PyPI's zig."""
    sources = [path for path in source_files(root, ".c") if path.parts[0] == "core"]
    if not sources:
        return []
    try:
        compiler = [found] if (found := shutil.which("clang")) else zig_cc()
    except BuildError as err:
        return [Problem(Path("core"), 0, f"{err.message}: {err.hint}")]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found_by_file = pool.map(lambda path: check_file(compiler, root, path), sources)
        return [problem for problems in found_by_file for problem in problems]


def check_file(compiler: list[str], root: Path, path: Path) -> list[Problem]:
    """One C file. @param path  relative to root"""
    command = [*compiler, *FLAGS, *(f"-I{root / folder}" for folder in HEADERS), str(root / path)]
    run = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if run.returncode != 0:
        return [Problem(path, 0, run.stderr.strip().partition("\n")[0])]
    return [
        Problem(path, line, f"{size} bytes by value; from {MAX_BYTES} on fill or memcpy() them in place")
        for line, size in large_copies(run.stdout)
    ]


def large_copies(code: str) -> Iterator[tuple[int, int]]:
    """Line and bytes of each copy in LLVM's code that is above MAX_BYTES."""
    lines = {match[1]: int(match[2]) for match in PLACE.finditer(code)}
    for match in COPY.finditer(code):
        if int(match[1]) > MAX_BYTES:
            yield lines.get(match[2], 0), int(match[1])
