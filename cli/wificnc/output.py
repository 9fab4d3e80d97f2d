"""Output files: known to be writable before the work, whole or not there after it. `-` is stdout."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from wificnc.errors import UserError

STDOUT = Path("-")


def check_suffix(option: str, path: Path, known: Sequence[str]) -> None:
    """Raises UserError when the suffix does not say what to write."""
    if path.suffix.lower() not in known:
        raise UserError(f"{option} {path}: supported formats are {', '.join(known[:-1])} and {known[-1]}")


def why_not_writable(path: Path, makes_folders: bool = False) -> str:
    """Why no file can be written there, before anything is done; "" when it looks good."""
    if path.is_dir():
        return "it is a folder"
    if path.exists():
        return "" if os.access(path, os.W_OK) else "it is write-protected"
    folder = path.parent
    while makes_folders and not folder.exists() and folder != folder.parent:
        folder = folder.parent
    if not folder.exists():
        return f"folder not found: {folder}"
    if not folder.is_dir():
        return f"{folder} is not a folder"
    return "" if os.access(folder, os.W_OK) else f"the folder {folder} is write-protected"


def write_output(option: str, path: Path, content: bytes) -> None:
    """All of it to the file, or to stdout. Raises UserError."""
    if path == STDOUT:
        write_stdout(content)
        return
    output = Output(option, path)
    try:
        output.write(content)
    finally:
        output.discard()


def write_stdout(content: bytes) -> None:
    """Bytes as they are, whatever the locale is."""
    sys.stdout.flush()
    sys.stdout.buffer.write(content)
    sys.stdout.buffer.flush()


class Output:
    """One output file, staged next to its final place. A device or pipe is written directly."""

    def __init__(self, option: str, path: Path) -> None:
        """Raises UserError when nothing can be written there."""
        self.path = path
        self._option = option
        self.staged = path if path.exists() and not path.is_file() and not path.is_dir() else self._stage()

    def _stage(self) -> Path:
        if why := why_not_writable(self.path):
            raise UserError(f"{self._option}: cannot write {self.path}: {why}")
        try:
            handle, name = tempfile.mkstemp(prefix=f".{self.path.stem}.", suffix=self.path.suffix, dir=self.path.parent)
            os.close(handle)
        except OSError as err:
            raise self._refused(err) from err
        return Path(name)

    def _refused(self, err: OSError) -> UserError:
        return UserError(f"{self._option}: cannot write {self.path}: {err.strerror}")

    def write(self, content: bytes) -> None:
        """Put all of it in place in one step. Raises UserError."""
        try:
            self.staged.write_bytes(content)
        except OSError as err:
            raise self._refused(err) from err
        self.publish()

    def publish(self) -> None:
        """The staged file is whole: to its place with it. Raises UserError."""
        if self.staged == self.path:
            return
        try:
            mask = os.umask(0)
            os.umask(mask)
            self.staged.chmod(0o666 & ~mask)
            os.replace(self.staged, self.path)
        except OSError as err:
            raise self._refused(err) from err

    def discard(self) -> None:
        """Leave nothing behind unless it was published."""
        if self.staged != self.path:
            self.staged.unlink(missing_ok=True)
