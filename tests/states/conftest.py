"""The table of states, walked in a controller in virtual time."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "grbl"))
sys.path.insert(0, str(Path(__file__).parents[1] / "pic32mz"))

from image_fixture import board, build, image

__all__ = ["board", "build", "image"]
