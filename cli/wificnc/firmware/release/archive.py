"""Tar archives whose bytes depend on names and contents alone."""

from __future__ import annotations

import gzip
import io
import tarfile
from collections.abc import Mapping

FILE_MODE = 0o644


def tar_gz(files: Mapping[str, bytes], epoch_s: int) -> bytes:
    """A .tar.gz, sorted by name, owned by no one. @param epoch_s  every time in it"""
    packed = io.BytesIO()
    with (
        gzip.GzipFile(fileobj=packed, mode="wb", compresslevel=9, mtime=epoch_s, filename="") as zipped,
        tarfile.open(fileobj=zipped, mode="w", format=tarfile.PAX_FORMAT) as archive,
    ):
        for name in sorted(files):
            row = tarfile.TarInfo(name)
            row.size, row.mtime = len(files[name]), epoch_s
            row.mode = FILE_MODE
            archive.addfile(row, io.BytesIO(files[name]))
    return packed.getvalue()
