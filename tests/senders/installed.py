"""What is not there is a skipped test at home and a failed one in CI."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import NoReturn

import pytest
from wificnc.build.lock import build_lock

INSTALL_SECONDS = 600


def missing(reason: str) -> NoReturn:
    """End the test."""
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


def install(name: str, argv: list[str], directory: Path) -> Path:
    """Once: a directory that says by its stamp that it is complete."""
    stamp = directory / ".installed"
    with build_lock(directory.parent / f"{name}.lock"):
        if stamp.exists() and stamp.read_text() == " ".join(argv):
            return directory
        shutil.rmtree(directory, ignore_errors=True)
        directory.mkdir(parents=True)
        try:
            run = subprocess.run(argv, cwd=directory, capture_output=True, text=True, timeout=INSTALL_SECONDS)
        except subprocess.TimeoutExpired:
            missing(f"{name} was not installed within {INSTALL_SECONDS} s")
        if run.returncode != 0:
            missing(f"{name} cannot be installed:\n{(run.stdout + run.stderr)[-2000:]}")
        stamp.write_text(" ".join(argv))
    return directory
