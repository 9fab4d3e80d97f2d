"""Fixtures: the page as it is built, a browser, a controller that serves it, and stand-ins for serial ports."""

from __future__ import annotations

from web_fixture import bridge, browser, built_page, console, serve_page, watched

__all__ = ["bridge", "browser", "built_page", "console", "serve_page", "watched"]
