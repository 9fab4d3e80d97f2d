"""Fixtures: the page as it is built, a browser, a controller that serves it, and stand-ins for serial ports."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "esp32"))  # chip.py

from web_fixture import bridge, browser, built_page, console, serve_page, watched

__all__ = ["bridge", "browser", "built_page", "console", "serve_page", "watched"]
