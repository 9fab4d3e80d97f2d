"""JSON that someone else has written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wificnc.files.bounded import SMALL_MAX, read_text


def read_json(path: Path) -> Any:
    """What the file has. Raises OSError when it cannot be read, ValueError for whatever is no JSON that we can use."""
    try:
        return json.loads(read_text(path, SMALL_MAX))
    except RecursionError as err:
        raise ValueError("nested too deeply") from err
