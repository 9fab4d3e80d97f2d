"""The library and the server program that a wheel for one kind of computer carries, so that it needs no compiler.

A checkout never uses them: it builds what its sources say.
"""

from __future__ import annotations

from pathlib import Path

from wificnc.build.platforms import System, this_system
from wificnc.files import paths

SERVER = "wificnc-serve"


def server_name(system: System) -> str:
    """The file of the server program."""
    return f"{SERVER}{system.program_suffix}"


def carried_library() -> Path | None:
    """The wheel's library; None in a checkout, and when the wheel is for every kind of computer."""
    return _carried(this_system().library)


def carried_server() -> Path | None:
    """The wheel's server program, as carried_library()."""
    return _carried(server_name(this_system()))


def _carried(name: str) -> Path | None:
    file = paths.NATIVE / name
    return file if not paths.IS_CHECKOUT and file.is_file() else None
