"""Objects that need no compiling: command, source and every file that it includes are what they were, byte for byte.

Times do not tell it: pins and settings of a board are generated for each run.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

COMPILER = Path(__file__).with_name("compile.py")  # which also rewrites what the compiler made


def depfile(made: Path) -> Path:
    """Where the compiler is to list what it has read."""
    return made.with_suffix(".d")


def is_unchanged(made: Path, command: Sequence[str]) -> bool:
    """Whether the object is what this command would make now."""
    stamp = made.with_suffix(".sha256")
    if not (made.is_file() and stamp.is_file() and depfile(made).is_file()):
        return False
    return stamp.read_text() == _fingerprint(made, command)


def note(made: Path, command: Sequence[str]) -> None:
    """It compiled without a word."""
    made.with_suffix(".sha256").write_text(_fingerprint(made, command))


def files_read(made: Path) -> list[Path]:
    """The source and every file that it includes, as the compiler listed them."""
    listed = depfile(made).read_text().partition(":")[2]
    return [Path(name) for name in sorted(set(re.split(r"[\s\\]+", listed.strip())))]


def _fingerprint(made: Path, command: Sequence[str]) -> str:
    found = hashlib.sha256("\0".join(command).encode())
    for path in (COMPILER, *files_read(made)):
        found.update(b"\0" + (path.read_bytes() if path.is_file() else b"gone"))
    return found.hexdigest()
