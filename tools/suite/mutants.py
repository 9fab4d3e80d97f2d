"""Faults made by machine: a line of the core, the network code or the command is changed, and tests must notice.

Each is made in a clone of the tree, so nothing here is touched; the same seed makes the same faults.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CLONE = ROOT / "build" / "mutants"
SOURCES = ("core/**/*.c", "targets/net/**/*.c", "cli/wificnc/**/*.py")
# What is read -> what is written in its place; spaces keep includes, arrows and increments out.
CHANGES = [
    (" < ", " <= "),
    (" <= ", " < "),
    (" > ", " >= "),
    (" >= ", " > "),
    (" == ", " != "),
    (" != ", " == "),
    (" + ", " - "),
    (" - ", " + "),
    (" * ", " / "),
    (" && ", " || "),
    (" || ", " && "),
    (" and ", " or "),
    ("true", "false"),
    ("false", "true"),
    ("True", "False"),
    ("False", "True"),
]
NO_CODE = re.compile(r'^\s*(//|/?\*|#|import |from |"""|assert )|"""')


@dataclass(frozen=True)
class Mutant:
    """One line that is another one."""

    path: Path  # from the root of the tree
    line: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.old.strip()}  ->  {self.new.strip()}"


def mutants_of(root: Path, path: Path) -> list[Mutant]:
    """All that this file has room for: the first place of each change in each line of code."""
    found = []
    for number, old in enumerate((root / path).read_text(encoding="utf-8").splitlines(), start=1):
        code = re.sub(r'"[^"]*"', lambda text: "\0" * len(text[0]), re.split(r"\s//|\s/\*|  #", old)[0])
        for read, written in [] if NO_CODE.search(old) else CHANGES:
            at = code.find(read)
            if at >= 0:
                found.append(Mutant(path, number, old, old[:at] + written + old[at + len(read) :]))
    return found


def chosen_mutants(root: Path, count: int, seed: int) -> list[Mutant]:
    """So many, of all sources, each line as likely as any other one."""
    paths = sorted(path.relative_to(root) for pattern in SOURCES for path in root.glob(pattern))
    every = [mutant for path in paths for mutant in mutants_of(root, path)]
    return random.Random(seed).sample(every, count)


def mutate(count: int, seed: int, tests: Sequence[str]) -> int:
    """Print for each whether it was noticed, and by which test. @return exit code: 1 when one was not"""
    shutil.rmtree(CLONE, ignore_errors=True)
    subprocess.run(["git", "clone", "--quiet", "--shared", str(ROOT), str(CLONE)], check=True)
    if said := noticed(tests):
        sys.exit(f"without any fault: {said}")
    survivors = []
    for mutant in chosen_mutants(CLONE, count, seed):
        path = CLONE / mutant.path
        text = path.read_text(encoding="utf-8")
        lines = text.split("\n")
        lines[mutant.line - 1] = mutant.new
        path.write_text("\n".join(lines), encoding="utf-8")
        said = noticed(tests)
        path.write_text(text, encoding="utf-8")
        survivors += [] if said else [mutant]
        print(f"{mutant}\n    {said or 'NOT NOTICED'}", flush=True)
    print(f"{count - len(survivors)} of {count} were noticed (seed {seed})")
    return 1 if survivors else 0


def noticed(tests: Sequence[str]) -> str:
    """By the compiler, or the first test that fails; nothing when all pass."""
    modules = os.pathsep.join(str(CLONE / name) for name in ("cli", "emulators"))
    environment = {**os.environ, "PYTHONPATH": modules, "PYTHONDONTWRITEBYTECODE": "1"}

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        words = (sys.executable, "-m", *words)
        return subprocess.run(words, cwd=CLONE, env=environment, capture_output=True, text=True, check=False)

    built = run("wificnc", "build", "host")
    if built.returncode:
        return f"the build: {built.stderr.strip().splitlines()[-1] if built.stderr.strip() else built.returncode}"
    options = ("-p", "no:cacheprovider", "-n", "auto", "-x", "-rfE", "-m", "core and not deep", "--cases-of-ci")
    tested = run("pytest", *options, *tests)
    if tested.returncode == 0:
        return ""
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", tested.stdout, re.MULTILINE)
    return found[1] if found else f"pytest ended with {tested.returncode}"
