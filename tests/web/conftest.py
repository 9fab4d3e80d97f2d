"""Fixtures: the page as it is built, a browser, a controller that serves it, and stand-ins for serial ports."""

from __future__ import annotations

from pathlib import Path

import pytest
from console_page import link, socket_link
from stories import mark_stories
from web_fixture import bridge, browser, built_page, console, serve_page, watched

__all__ = ["bridge", "browser", "built_page", "console", "link", "serve_page", "socket_link", "watched"]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    mark_stories(items, Path(__file__).parent)
