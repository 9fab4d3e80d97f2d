"""The fixture that serves."""

from __future__ import annotations

from serve_fixture import serve

__all__ = ["serve"]
