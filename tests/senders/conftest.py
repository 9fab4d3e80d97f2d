"""Real senders: installed by name from their registries into build/senders, and driven without hands."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from wificnc.build.checkout import checkout_root

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "serve"))

from installed import install, missing
from serve_fixture import serve

__all__ = ["serve"]

Install = Callable[..., Path]


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
        return install(name, [npm, "install", "--prefix", str(directory), *options, *packages], directory)

    return get
