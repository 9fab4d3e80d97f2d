"""LinuxCNC's programs as an ordinary user: they refuse to run as root."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from wificnc.build.checkout import checkout_root

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "wire")]  # bench, wire_device
PYTHON = "/usr/bin/python3"  # LinuxCNC's modules are the system's
NOBODY = "65534"


@pytest.fixture(scope="session", autouse=True)
def _component() -> None:
    """Compile it before anything is timed."""
    from component_library import library

    library()


@pytest.fixture
def user_home() -> Iterator[Path]:
    """A folder that the user may write; pytest's own are not for others."""
    home = Path(tempfile.mkdtemp())
    home.chmod(0o777)
    yield home
    shutil.rmtree(home)


@pytest.fixture
def as_user(user_home: Path) -> Callable[..., str]:
    """Run a program; what it said on stdout."""
    if not shutil.which("halrun") or not shutil.which("unshare") or not shutil.which("setpriv"):
        pytest.skip("LinuxCNC is not here: apt-get install linuxcnc-uspace")
    if subprocess.run([PYTHON, "-c", "import hal"], capture_output=True).returncode != 0:
        pytest.skip("LinuxCNC's Python module is not here")

    def run(*argv: str) -> str:
        if os.geteuid() == 0:  # a LinuxCNC of its own: neither HAL's shared memory nor processes of another one
            user = ("--reuid", NOBODY, "--regid", NOBODY, "--clear-groups")
            argv = ("unshare", "--ipc", "--pid", "--fork", "--kill-child", "--mount-proc", "setpriv", *user, *argv)
        environment = {
            **os.environ,
            "HOME": str(user_home),
            "PYTHONPATH": str(checkout_root() / "cli"),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        done = subprocess.run(argv, capture_output=True, text=True, timeout=120, env=environment)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run
