"""core/settings alone, as a small shared library."""

from __future__ import annotations

import ctypes
import os
import subprocess

import pytest
from settings_core import ROOT, Settings, Values
from wificnc.build.compiler import locate_compiler

FLAGS = ["-std=c11", "-O1", "-g", "-fPIC", "-shared", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
SOURCES = ["core/settings/settings.c", "core/settings/settings_table.c"]


@pytest.fixture(scope="session")
def library() -> ctypes.CDLL:
    """Compiled anew in each session: it takes a moment, and is never stale."""
    folder = ROOT / "build" / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"settings-{os.getpid()}.so"
    subprocess.run([*locate_compiler(), *FLAGS, "-Icore", *SOURCES, "-o", str(built)], cwd=ROOT, check=True)
    final = built.replace(folder / "settings.so")
    library = ctypes.CDLL(str(final))
    library.settings_set.argtypes = [ctypes.POINTER(Values), ctypes.c_uint16, ctypes.c_double, ctypes.c_uint8]
    library.settings_get.restype = ctypes.c_bool
    library.settings_get.argtypes = [
        ctypes.POINTER(Values),
        ctypes.c_uint16,
        ctypes.c_uint8,
        ctypes.POINTER(ctypes.c_double),
        ctypes.POINTER(ctypes.c_uint8),
    ]
    library.settings_next.restype = ctypes.c_bool
    library.settings_next.argtypes = [ctypes.POINTER(ctypes.c_uint16), ctypes.c_uint8]
    return library


@pytest.fixture
def settings(library: ctypes.CDLL) -> Settings:
    """All settings at their defaults."""
    return Settings(library)
