"""Tests that need a program which a machine with Python alone has not."""

from __future__ import annotations

import shutil

import pytest

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="git is not here: apt-get install git")
