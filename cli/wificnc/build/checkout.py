"""Where the sources are. Builds need a checkout; an installed wheel has none."""

from __future__ import annotations

from pathlib import Path

from wificnc.errors import BuildError


def find_checkout() -> Path | None:
    """The repository's root when this package runs from a checkout (`pip install -e .`), else None."""
    root = Path(__file__).resolve().parents[3]
    return root if (root / "core" / "config.h").is_file() else None


def checkout_root() -> Path:
    """The repository's root. Raises BuildError outside a checkout."""
    root = find_checkout()
    if root is None:
        raise BuildError(
            "the controller's C sources are not here: builds run from a checkout of the repository",
            hint="git clone the WiFiCNC repository, then run `pip install -e .` in it",
        )
    return root
