"""The component as halcompile builds it, and LinuxCNC's programs as an ordinary user: they refuse to run as root."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from bench.halrun import isolated
from patience import BUILD_S, HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.linuxcnc.source import FILE_NAME, build_command, component_source

if TYPE_CHECKING:
    from link_bench import Bench

PYTHON = "/usr/bin/python3"  # LinuxCNC's modules are the system's
NICE = -15


def open_folder() -> Path:
    """A folder for every user; pytest's own are not for others."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    return folder


STOPPED = "servo thread (has )?stopped"  # a pattern of linuxcnc/motion.c's words and of messages.def's


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without real time a busy computer can stop LinuxCNC for a second. The component then ends the motion, rightly,
    and says why: such a run tells nothing, and is made again. One that fails with other words is not."""
    for item in items:
        if "as_user" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.flaky(reruns=2, only_rerun=[STOPPED]))


@pytest.fixture(scope="session")
def hal_program() -> Iterator[Path]:
    """The component's program, from the one file that users get, with no warning."""
    if not shutil.which("halcompile"):
        pytest.skip("LinuxCNC's halcompile is not here: apt-get install linuxcnc-uspace-dev")
    folder = open_folder()
    source = folder / FILE_NAME
    source.write_text(component_source(checkout_root()), encoding="utf-8")
    argv = build_command("compile", str(source), "--extra-compile-args=-Wall -Wextra")
    done = subprocess.run(argv, capture_output=True, text=True, timeout=BUILD_S, check=False)
    assert done.returncode == 0 and "warning" not in done.stderr, done.stdout + done.stderr
    yield source.with_suffix("")
    shutil.rmtree(folder)


@pytest.fixture(scope="session", autouse=True)
def _component() -> None:
    """Compile it before anything is timed."""
    from component_library import library

    library()


@pytest.fixture
def make_bench() -> Iterator[Callable[..., Bench]]:
    """Benches with a controller of 200 steps/mm that reports every 10 ms."""
    from link_bench import Bench
    from wire_device import Device

    made: list[Device] = []

    def make(settings: dict[int, float] | None = None, key: str = "", joints: int = 3, **board: int) -> Bench:
        made.append(Device(key, settings={76: 10, **(settings or {})}, **board))
        return Bench(made[-1], joints, key=key)

    yield make
    for device in made:
        device.close()


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    return make_bench()


@pytest.fixture
def user_home() -> Iterator[Path]:
    """A folder that the user may write."""
    home = open_folder()
    yield home
    shutil.rmtree(home)


@pytest.fixture
def before_others() -> Iterator[None]:
    """LinuxCNC gives up when its servo thread, which is no real-time one here, does not run for a second."""
    usual = os.getpriority(os.PRIO_PROCESS, 0)
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, NICE)  # and what is started from here on
    yield
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, usual)


@pytest.fixture
def as_user(user_home: Path, hal_program: Path, before_others: None) -> Callable[..., str]:
    """Run a program that finds the component as one of the system's; what it said, and when it fails all of that."""
    if not shutil.which("halrun") or not shutil.which("unshare") or not shutil.which("setpriv"):
        pytest.skip("LinuxCNC is not here: apt-get install linuxcnc-uspace")
    if subprocess.run([PYTHON, "-c", "import hal"], capture_output=True).returncode != 0:
        pytest.skip("LinuxCNC's Python module is not here")

    def run(*argv: str, code: int = 0) -> str:
        environment = {
            **os.environ,
            "HOME": str(user_home),
            "PATH": f"{hal_program.parent}{os.pathsep}{os.environ['PATH']}",
        }
        # longer than any wait in there, which then says what does not come
        done = subprocess.run(isolated(*argv), capture_output=True, text=True, timeout=4 * HANG_S, env=environment)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + (done.stderr if code else "")

    return run
