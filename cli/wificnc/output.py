"""Output files: known to be writable before the run, whole or not there after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from wificnc.errors import UserError


def check_suffix(option: str, path: Path, known: Sequence[str]) -> None:
    """Raises UserError when the suffix does not say what to write."""
    if path.suffix.lower() not in known:
        raise UserError(f"{option} {path}: I can write {', '.join(known[:-1])} and {known[-1]}")


class Output:
    """One output file, staged beside its final place. A device or pipe is written directly."""

    def __init__(self, option: str, path: Path) -> None:
        """Raises UserError when nothing can be written there."""
        self.path = path
        self._option = option
        self.staged = path if path.exists() and not path.is_file() and not path.is_dir() else self._stage()

    def _stage(self) -> Path:
        try:
            if self.path.is_dir():
                raise IsADirectoryError(21, "it is a folder")
            if self.path.exists() and not os.access(self.path, os.W_OK):
                raise PermissionError(13, "it is write-protected")
            handle, name = tempfile.mkstemp(prefix=f".{self.path.stem}.", suffix=self.path.suffix, dir=self.path.parent)
            os.close(handle)
        except OSError as err:
            raise self._refused(err) from err
        return Path(name)

    def _refused(self, err: OSError) -> UserError:
        return UserError(f"{self._option}: cannot write {self.path}: {err.strerror}")

    def write(self, content: bytes) -> None:
        """Put all of it in place at once. Raises UserError."""
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
