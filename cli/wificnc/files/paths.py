"""Where the files next to the Python code are, and how messages show a path."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]

CHECKOUT = _PACKAGE.parents[1]  # the repository's root, when this package runs from one (`pip install -e .`)
CARRIED = _PACKAGE / "carried"  # the same tree inside an installed package: tables, boards, C sources, firmware
PAGE = _PACKAGE / "page"  # the page for browsers, in an installed package
NATIVE = _PACKAGE / "native"  # library and server program, in a wheel for one kind of computer
IS_CHECKOUT = (CHECKOUT / "core" / "config.h").is_file()

ROOT = CHECKOUT if IS_CHECKOUT else CARRIED  # to read from


def shown(path: Path) -> str:
    """A path as a message shows it: relative to the working directory or the repository where it lies inside."""
    resolved = path.resolve()
    for base in (Path.cwd(), ROOT):
        if resolved.is_relative_to(base):
            return resolved.relative_to(base).as_posix()
    return path.as_posix()
