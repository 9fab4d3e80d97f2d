"""The host library for the tests of the simulation."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from c_library import load
from layouts import HOST
from wificnc.build.host import ensure_host_library


@pytest.fixture(scope="session")
def library() -> ctypes.CDLL:
    return load(ensure_host_library(), HOST)


@pytest.fixture
def job(tmp_path: Path):
    """Write a job file; returns its path."""

    def write(text: str | bytes, name: str = "job.nc") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write
