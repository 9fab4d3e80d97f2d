"""Windows programs on this computer, by Wine, in a folder of its own for what Wine keeps."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from patience import BUILD_S, HANG_S

MISSING = "wine is not installed; Debian: apt-get install wine wine64"


def has_wine() -> bool:
    return shutil.which("wine") is not None


@contextmanager
def wine_environment(folder: Path) -> Iterator[dict[str, str]]:
    """The environment for `wine PROGRAM`, until the end of which Wine's server runs. Without .NET and a browser, which
    Wine would offer to install."""
    environment = {
        **os.environ,
        "WINEPREFIX": str(folder),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree=;mshtml=",
        "DISPLAY": "",
    }
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    subprocess.run(["wineboot", "--init"], env=environment, timeout=BUILD_S, check=False, **quiet)
    try:
        yield environment
    finally:
        subprocess.run(["wineserver", "--kill"], env=environment, timeout=HANG_S, check=False, **quiet)
