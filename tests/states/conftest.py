"""The table of states, walked in a controller in virtual time."""

from __future__ import annotations

from image_fixture import board, build, image

__all__ = ["board", "build", "image"]
