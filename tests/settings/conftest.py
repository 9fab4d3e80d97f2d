"""core/settings alone, as a small shared library."""

from __future__ import annotations

import ctypes
import os
import subprocess

import pytest
from c_library import load
from layouts import HOST
from settings_core import ROOT, Settings
from wificnc.build.compiler import locate_compiler

FLAGS = ["-std=c11", "-O1", "-g", "-fPIC", "-shared", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
SOURCES = ["core/settings/settings.c", "core/settings/settings_table.c"]


@pytest.fixture(scope="session")
def library() -> ctypes.CDLL:
    """Compiled again in each session: it takes a moment, and is never stale."""
    folder = ROOT / "build" / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"settings-{os.getpid()}.so"
    subprocess.run([*locate_compiler(), *FLAGS, "-Icore", *SOURCES, "-o", str(built)], cwd=ROOT, check=True)
    final = built.replace(folder / "settings.so")
    return load(final, HOST)


@pytest.fixture
def settings(library: ctypes.CDLL) -> Settings:
    """All settings at their defaults."""
    return Settings(library)
