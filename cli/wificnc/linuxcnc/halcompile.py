"""LinuxCNC's halcompile: it builds the component from its one C file, and puts it where `loadusr` looks."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from wificnc.errors import BuildError
from wificnc.linuxcnc.source import FILE_NAME, PROGRAM, build_command

GET = "apt install linuxcnc-uspace-dev build-essential"
SAID_LINES = 30


def target_folder(halcompile: Path, environment: Mapping[str, str]) -> Path:
    """Where halcompile puts programs."""
    return Path(environment.get("USER_MODULE_DIR") or halcompile.parent.parent / "bin")


def install(source: str, *, sudo: bool = False) -> Path:
    """Build the component and install it. @param sudo  by that program, which may ask for a password
    @return the program

    Raises:
        BuildError: halcompile is not here, may not write there, or the build fails.
    """
    found = shutil.which("halcompile")
    if not found:
        raise BuildError("halcompile is not installed; it builds LinuxCNC components", hint=GET)
    folder = target_folder(Path(found), {} if sudo else os.environ)  # sudo keeps no variables
    by_hand = f"wificnc linuxcnc component && sudo {' '.join(build_command('install', FILE_NAME))}"
    if sudo and not shutil.which("sudo"):
        raise BuildError("sudo is not installed", hint=f"as root: {by_hand.replace('sudo ', '')}")
    if not sudo and not os.access(folder, os.W_OK):
        raise BuildError(f"only root may write to {folder}", hint=f"--install --sudo, or by hand: {by_hand}")
    with tempfile.TemporaryDirectory() as scratch:  # not where the user is: halcompile takes no path with a space
        file = Path(scratch) / FILE_NAME
        file.write_text(source, encoding="utf-8")
        argv = [*(["sudo"] if sudo else []), found, *build_command("install", str(file))[1:]]
        run = subprocess.run(argv, capture_output=True, text=True, encoding="utf-8", errors="replace", check=False)
    if run.returncode != 0:
        said = (run.stdout + run.stderr).strip().splitlines()[-SAID_LINES:]
        raise BuildError("\n".join(["halcompile could not build the component:", *said]))
    return folder / PROGRAM
