"""Real senders: installed by name from their registries into build/senders, and driven without hands."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from wificnc.build.checkout import checkout_root
from wificnc.build.lock import build_lock

sys.path.insert(0, str(Path(__file__).parents[1] / "serve"))

from serve_fixture import serve

__all__ = ["serve"]

INSTALL_SECONDS = 240
Install = Callable[..., Path]


def missing(reason: str) -> None:
    """A sender that cannot be had is a skipped test at home and a failed one in CI."""
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


@pytest.fixture
def from_pypi() -> Install:
    """Install packages beside, not into, this Python's own."""

    def get(name: str, *packages: str) -> Path:
        directory = checkout_root() / "build" / "senders" / name
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-warn-conflicts"]
        return install(name, [*pip, "--no-deps", "--target", str(directory), *packages], directory)

    return get


@pytest.fixture
def from_npm() -> Install:
    """Install packages of npm, without running their install scripts."""

    def get(name: str, *packages: str) -> Path:
        npm = shutil.which("npm")
        if npm is None or shutil.which("node") is None:
            missing(f"{name} needs node and npm")
        directory = checkout_root() / "build" / "senders" / name
        options = ["--no-audit", "--no-fund", "--ignore-scripts", "--omit=dev", "--loglevel=error"]
        return install(name, [str(npm), "install", "--prefix", str(directory), *options, *packages], directory)

    return get
