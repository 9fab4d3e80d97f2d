"""The Python packages, built from the tracked files alone: the command with firmware in it, and the virtual chips."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from wificnc.errors import ReleaseError

SAID_LINES = 20
PACKAGES = (".", "emulators")  # folders with a pyproject.toml


def tracked_files(root: Path) -> list[str]:
    """Every file that git knows and that is there. Raises ReleaseError."""
    run = subprocess.run(
        ["git", "-C", str(root), "ls-files", "-z"],
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
        errors="replace",
    )
    if run.returncode != 0:
        raise ReleaseError(f"{root} is not a git repository: a release is made from a commit", hint="git clone it")
    return [name for name in run.stdout.split("\0") if name and (root / name).is_file()]


def build_packages(root: Path, work: Path, output: Path, made: Mapping[str, bytes], epoch_s: int) -> None:
    """Wheels and sdists into output. @param made  path -> content of what git does not know: firmware, page

    Raises:
        ReleaseError: hatchling is missing, or fails.
    """
    if importlib.util.find_spec("hatchling") is None:
        raise ReleaseError(
            "hatchling is not installed, and it builds the package", hint="pip install 'hatchling>=1.27'"
        )
    stage = work / "stage"
    for name in tracked_files(root):
        (stage / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(root / name, stage / name)
    for name, data in made.items():
        path = stage / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(epoch_s)}
    for package in PACKAGES:
        _build(stage / package, output, environment)


def _build(folder: Path, output: Path, environment: Mapping[str, str]) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(output)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
        errors="replace",
    )
    if run.returncode != 0:
        said = (run.stdout + run.stderr).splitlines()[-SAID_LINES:]
        raise ReleaseError("\n".join(["hatchling could not build the package:", *said]))


def carried_esp32(board_id: str, record: Mapping[str, object], folder: Path, names: Sequence[str]) -> dict[str, bytes]:
    """A build of an ESP32 as the package carries it: without the ELF, which is large and only for debuggers."""
    files = {name: (folder / name).read_bytes() for name in names}
    rows = [
        {"name": name, "size": len(data), "sha256": hashlib.sha256(data).hexdigest()} for name, data in files.items()
    ]
    files["build.json"] = (json.dumps({**record, "artefacts": rows}, indent=2) + "\n").encode()
    return {f"{board_id}/{name}": data for name, data in files.items()}
