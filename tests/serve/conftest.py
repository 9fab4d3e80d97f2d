"""The fixture that serves."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from serve_fixture import serve

__all__ = ["serve"]
