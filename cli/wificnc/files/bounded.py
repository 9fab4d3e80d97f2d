"""Files of others, read up to a size: one that is too large by mistake, or a device without an end, is refused."""

from __future__ import annotations

import errno
import io
from pathlib import Path

PIECE = 1 << 20
SMALL_MAX, IMAGE_MAX, JOB_MAX = 4 << 20, 64 << 20, 512 << 20  # bytes: of texts, of a chip's flash, of jobs and logs


def read_bytes(path: Path, bytes_max: int) -> bytes:
    """All of it. Raises OSError when it cannot be read, or is larger."""
    pieces, size = [], 0
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            pieces.append(piece)
            size += len(piece)
            if size > bytes_max:
                raise OSError(errno.EFBIG, f"is larger than {bytes_max / PIECE:g} MB", str(path))
    return b"".join(pieces)


def read_text(path: Path, bytes_max: int, errors: str = "strict") -> str:
    """All of it; its lines end with \\n. Raises OSError as read_bytes(), UnicodeDecodeError."""
    data = io.BytesIO(read_bytes(path, bytes_max))
    return io.TextIOWrapper(data, encoding="utf-8-sig", errors=errors).read()
