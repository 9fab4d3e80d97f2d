"""Where builds run: in the checkout, or in a copy of the sources that an installed package carries.

A package lies where no one may write, so its sources are copied once into this user's cache; what is built there stays
until another version comes.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from wificnc import __version__
from wificnc.errors import BuildError
from wificnc.files import paths

NO_SOURCES = "the controller's C sources are missing, and builds need them"
INSTALL_HINT = "install wificnc again; or git clone the WiFiCNC repository, then run `pip install -e .` in it"


def find_checkout() -> Path | None:
    """The repository's root when this package runs from a checkout (`pip install -e .`), else None."""
    return paths.CHECKOUT if paths.IS_CHECKOUT else None


def checkout_root() -> Path:
    """The tree that builds run in, with its sources: build/ is theirs. Raises BuildError when there are no sources."""
    root = find_checkout()
    if root is None:
        root = copied_tree(paths.CARRIED)
        if not root.is_dir():
            copy_tree(paths.CARRIED, root)
    return root


def built_folder(board_id: str) -> Path | None:
    """Where a build of this board would be found; None when nothing can have been built. Copies nothing."""
    root = find_checkout()
    if root is None:
        root = copied_tree(paths.CARRIED)
    return root / "build" / board_id if root.is_dir() else None


def copied_tree(carried: Path, environment: Mapping[str, str] = os.environ) -> Path:
    """Where the copy of these sources lies, or will. Other sources, another place. Raises BuildError."""
    if not (carried / "core" / "config.h").is_file():
        raise BuildError(NO_SOURCES, hint=INSTALL_HINT)
    digest = hashlib.sha256()
    for file in sorted(path for path in carried.rglob("*") if path.is_file()):
        digest.update(f"{file.relative_to(carried).as_posix()}\0{file.stat().st_size}\0".encode())
        digest.update(file.read_bytes())
    return cache_directory(environment) / f"{__version__}-{digest.hexdigest()[:12]}"


def cache_directory(environment: Mapping[str, str] = os.environ, platform: str = sys.platform) -> Path:
    """This user's cache for us: WIFICNC_CACHE, or what the system has for that."""
    if given := environment.get("WIFICNC_CACHE"):
        return Path(given)
    if platform == "win32" and (local := environment.get("LOCALAPPDATA")):
        return Path(local) / "wificnc" / "cache"
    if platform == "darwin":
        return Path.home() / "Library" / "Caches" / "wificnc"
    return Path(environment.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wificnc"


def copy_tree(carried: Path, root: Path) -> None:
    """Copy next to it, then rename: no one sees half a tree, and who comes second takes the first one's."""
    try:
        root.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=root.parent, prefix=".copy-") as temporary:
            fresh = Path(temporary) / "tree"
            shutil.copytree(carried, fresh, copy_function=shutil.copyfile)
            try:
                fresh.rename(root)
            except OSError:
                if not root.is_dir():
                    raise
    except OSError as err:
        hint = "WIFICNC_CACHE names another folder"
        raise BuildError(f"the sources cannot be copied to {root}: {err.strerror or err}", hint=hint) from err
