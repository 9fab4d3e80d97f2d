"""Fixtures: the page as it is built, a browser, a controller that serves it, and stand-ins for serial ports."""

from __future__ import annotations

from console_page import link, socket_link
from web_fixture import bridge, browser, built_page, console, serve_page, watched

__all__ = ["bridge", "browser", "built_page", "console", "link", "serve_page", "socket_link", "watched"]
