"""Find, read and check machine profiles."""

from __future__ import annotations

import os
from pathlib import Path

from wificnc.errors import MachineError
from wificnc.files.paths import ROOT
from wificnc.files.problem import FileProblems, Problem
from wificnc.files.shape import closest, locate, validate
from wificnc.files.tomlfile import read_toml
from wificnc.profile import rules
from wificnc.profile.model import Machine

PROFILES = ROOT / "examples" / "machines"


def find_machines() -> dict[str, Path]:
    """The profiles that come with WiFiCNC: name (file stem) -> file, in the order of names."""
    return {path.stem: path for path in sorted(PROFILES.glob("*.toml"))}


def load_machine(machine: str | Path) -> Machine:
    """Read a profile: a file, or the name of one that comes with WiFiCNC.

    Raises:
        MachineError: none exists, or it breaks rules; the message lists every problem with file and line.
    """
    try:
        return _checked(_locate(machine))
    except FileProblems as err:
        raise MachineError(err.message) from err


def check_machine(path: Path) -> list[Problem]:
    """Every problem of a profile; none when it is good."""
    try:
        _checked(path)
    except FileProblems as err:
        return list(err.problems)
    return []


def _checked(path: Path) -> Machine:
    source = read_toml(path)
    profile = validate(Machine, source)
    findings = rules.check(profile)
    if findings:
        raise FileProblems(locate(findings, source))
    return profile


def _locate(machine: str | Path) -> Path:
    """A word is a name unless such a file is there; anything that looks like a path is one."""
    path = Path(machine)
    if isinstance(machine, Path) or path.suffix or os.sep in machine or path.is_file():
        return path
    known = find_machines()
    if machine not in known:
        meant = closest(machine, known)
        hint = f"did you mean {meant}?" if meant else f"known here: {', '.join(known)}"
        raise MachineError(f"no machine profile {machine}", f"{hint} Or give the path of a TOML file.")
    return known[machine]
