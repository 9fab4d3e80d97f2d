"""The file that keeps settings: one server at a time, and errors in words."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

from wificnc.errors import ServeError

# As targets/pc/port_posix.c and port_windows.c lock it.
if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def store_failure(path: Path, error: int) -> ServeError:
    """Why `--settings path` cannot be used."""
    name = f"--settings {path}"
    if error == errno.EISDIR:
        return ServeError(f"{name} is a folder", hint=f"name a file, like {path / 'settings.bin'}")
    if error == errno.EINVAL:
        return ServeError(f"{name} is not an ordinary file", hint="choose another name")
    if error == errno.ENOENT:
        return ServeError(f"{name}: folder not found: {path.parent}", hint=f"mkdir -p {path.parent}")
    if error in (errno.EAGAIN, errno.EACCES) and _is_writable(path):
        return ServeError(
            f"{name} is in use by another server, and both would overwrite it",
            hint="stop that server, or choose another file",
        )
    return ServeError(f"{name}: {os.strerror(error)}", hint="check that its folder is writable")


def _is_writable(path: Path) -> bool:
    return os.access(path.parent, os.W_OK | os.X_OK)


def claim_store(path: Path) -> int:
    """Lock the file for this process, as targets/pc/serve_claim.c does; os.close() releases it.

    Raises:
        ServeError: it cannot be used, or another server has it.
    """
    if path.exists() and not path.is_file():
        raise store_failure(path, errno.EISDIR if path.is_dir() else errno.EINVAL)
    try:
        lock = os.open(f"{path}.lock", os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as err:
        raise store_failure(path, err.errno or 0) from err
    try:
        _lock(lock)
    except OSError as err:
        os.close(lock)
        raise store_failure(path, errno.EAGAIN) from err
    return lock
