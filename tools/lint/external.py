"""Ready-made tools as lints: each gives what the tool says, a line a problem."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from wificnc.build.compiler import identify_compiler
from wificnc.build.cross import zig_cc
from wificnc.build.host import FOLDERS, HEADERS, SYSTEM, WARNINGS
from wificnc.build.platforms import PLATFORMS, sources_of
from wificnc.errors import BuildError

from lint.problem import Problem, source_files

SOURCES = (*FOLDERS, "linuxcnc")
INCLUDE_PATHS = (*HEADERS, "linuxcnc")
CPPCHECK = (
    "--enable=warning,style,performance,portability",
    "--std=c11",
    "--platform=unix64",
    "--inline-suppr",
    "--error-exitcode=1",
    "--suppress=missingIncludeSystem",
    "--quiet",
    "--template={file}:{line}: {severity}: {message} [{id}]",
)
PYTHON = ("cli", "conftest.py", "emulators", "tools", "tests", "examples")
HAL_PROGRAM = "linuxcnc/wificnc.c"  # needs LinuxCNC's headers: tests/linuxcnc builds it by halcompile, with warnings
NEWEST_CLANG, OLDEST_CLANG = 40, 15  # releases that are looked for
FOREIGN = PLATFORMS["windows-x86_64"]  # compiles the sources that Linux and macOS do not
COMPILED = (*(f"{path}/" for path in SOURCES), "tools/bench/", "emulators/wificnc_chips/")


def check_ruff(root: Path) -> list[Problem]:
    return run_tool(
        root, [*module("ruff"), "check", "--output-format=concise", "--quiet", "--no-cache", *present(root, PYTHON)]
    )


def check_ruff_format(root: Path) -> list[Problem]:
    return run_tool(root, [*module("ruff"), "format", "--check", "--no-cache", *present(root, PYTHON)])


def check_mypy(root: Path) -> list[Problem]:
    here = run_tool(root, [*module("mypy"), "--no-error-summary"])
    # A cache of its own: mypy throws away one that another platform made.
    other = ("--platform", "win32", "--cache-dir", ".mypy_cache/win32")
    windows = run_tool(root, [*module("mypy"), "--no-error-summary", *other, "cli/wificnc", "emulators/wificnc_chips"])
    return sorted({*here, *windows})


def check_clang_format(root: Path) -> list[Problem]:
    files = [str(path) for path in source_files(root, ".c", ".h")]
    if not files:
        return []
    problems = run_tool(root, [script("clang-format"), "--dry-run", "-Werror", "--style=file", *files])
    first = {problem.path: problem for problem in reversed(problems) if problem.line}
    return sorted(Problem(path, problem.line, "not formatted (`make format`)") for path, problem in first.items())


def check_cppcheck(root: Path) -> list[Problem]:
    paths = [f"-I{path}" for path in INCLUDE_PATHS]
    return run_tool(root, [script("cppcheck"), *CPPCHECK, *paths, *present(root, SOURCES)])


def check_compilers(root: Path) -> list[Problem]:
    """Every C file through gcc and the newest clang of this machine, with all warnings as errors."""
    compiled = [path for path in source_files(root, ".c") if str(path).startswith(COMPILED)]
    compiled = [path for path in compiled if str(path) != HAL_PROGRAM]
    sources = sources_of(SYSTEM, compiled)
    flags = ["-std=c11", *WARNINGS, "-Werror", *(f"-I{path}" for path in INCLUDE_PATHS)]
    here = [*SYSTEM.macros, *flags]
    problems = []
    newest = _newest_clang() or shutil.which("clang")
    for path in filter(None, (shutil.which("gcc"), newest)):
        problems += run_tool(root, [path, *here, "-fsyntax-only", *map(str, sources)]) if sources else []
    if importlib.util.find_spec("ziglang"):
        if _release(zig_cc()) > (_release([newest]) if newest else 0):
            problems += _check_zig(root, here, sources)
        foreign = sorted({*sources_of(FOREIGN.system, compiled)} - {*sources})
        problems += _check_zig(root, [*FOREIGN.target_flags, *FOREIGN.system.macros, *flags], foreign)
    return problems


def _newest_clang() -> str | None:
    """Of those with their release in their name, as Debian has several next to each other."""
    names = (f"clang-{release}" for release in range(NEWEST_CLANG, OLDEST_CLANG - 1, -1))
    return next(filter(None, map(shutil.which, names)), None)


def _release(argv: Sequence[str]) -> int:
    """Of a clang, by its own word; 0 when it does not run."""
    try:
        version = identify_compiler(tuple(argv)).version
    except (OSError, BuildError):
        return 0
    return int(version.partition(".")[0]) if version[:1].isdigit() else 0


def _check_zig(root: Path, flags: Sequence[str], sources: Sequence[Path]) -> list[Problem]:
    """PyPI's zig. It cannot check without compiling, nor several files in one call: twice the time of that clang."""

    def check(source: Path) -> list[Problem]:
        with tempfile.TemporaryDirectory() as scratch:
            argv = [*zig_cc(), *flags, "-c", str(source), "-o", f"{scratch}/object.o"]
            return run_tool(root, argv)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return [problem for problems in pool.map(check, sources) for problem in problems]


def check_generated(root: Path) -> list[Problem]:
    """Text that is made from other text must be what would be made now."""
    return run_tool(root / "tools", [*module("generate"), "--check"])


def present(root: Path, names: Sequence[str]) -> list[str]:
    return [name for name in names if (root / name).exists()]


def module(name: str) -> list[str]:
    return [sys.executable, "-m", name]


def script(name: str) -> str:
    """A console script of this Python's environment."""
    path = Path(sys.executable).parent / name
    return str(path) if path.exists() else name


def run_tool(root: Path, argv: Sequence[str]) -> list[Problem]:
    """Run a tool in root. What it says becomes problems when it fails; a tool that is missing is one too."""
    try:
        run = subprocess.run(argv, cwd=root, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    except FileNotFoundError:
        return [Problem(Path(argv[0]), 0, "not installed: run `make lint`, which installs it")]
    if run.returncode == 0:
        return []
    said = (run.stdout + run.stderr).strip() or f"{Path(argv[0]).name} ended with {run.returncode}"
    return [_problem(line) for line in said.splitlines()]


def _problem(line: str) -> Problem:
    match = re.match(r"([^:\s]+):(\d+):(?:\d+:)?\s*(.*)", line)
    return Problem(Path(match[1]), int(match[2]), match[3]) if match else Problem(Path("."), 0, line)
