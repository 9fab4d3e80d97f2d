"""MkDocs over the staged pages; every warning is a problem."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from pages.stage import stage

STAGED = "build/site-pages"  # docs_dir of mkdocs.yml


def build(root: Path, site: Path) -> list[str]:
    """Build the site of a repository. @return what is wrong with it: links, anchors, pages that no menu has"""
    stage(root, root / STAGED)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(root / "mkdocs.yml"), "-d", str(site)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}  # a word of the theme's about its future
    run = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    if run.returncode == 0:
        return []
    return [line for line in run.stderr.splitlines() if line and not line.startswith("INFO")]
