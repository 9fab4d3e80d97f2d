"""Real senders: installed by name from their registries into build/senders, and driven without hands; against the
host's controller, against the PIC32MZ's real image in the virtual chip, and over the Ethernet of an ESP32's, where
there is one (esp_process.py)."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from esp_process import IMAGE, EspProcess
from image_fixture import ALL_ON_CHIP, board, build, image
from installed import install, missing
from job import KEY
from serve_chip import ChipProcess
from serve_fixture import serve
from wificnc.build.checkout import checkout_root
from wificnc.simulator.serve.server import Server

__all__ = ["board", "build", "image", "serve"]

SPEED = 2.0  # times real time: senders poll by the wall clock and must see the machine run
BEHIND_A_LOGIN = {"test_grbl_streamer", "test_bcnc_sender", "test_cncjs"}  # at the network of a controller with a key
ON_CHIP_ALWAYS = {"test_plain_character_counting", "test_grbl_streamer"}  # the others with make test-chip


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "server" in metafunc.fixturenames:
        on_chip = ALL_ON_CHIP or metafunc.definition.name in ON_CHIP_ALWAYS
        here = "locked" if metafunc.definition.name in BEHIND_A_LOGIN else "host"
        where = [here, *[pytest.param("chip", marks=pytest.mark.slow)] * on_chip, *["esp"] * bool(IMAGE)]
        metafunc.parametrize("server", where, indirect=True)


@pytest.fixture
def server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Server | ChipProcess | EspProcess]:
    """250 steps/mm, 5000 mm/min, 500 mm/s2, at a pseudo-terminal and at TCP."""
    if request.param == "esp":
        with EspProcess(tmp_path) as process:
            yield process
        return
    if request.param != "chip":
        key = KEY if request.param == "locked" else ""
        yield request.getfixturevalue("serve")(speed=SPEED, pty=True, key=key)
        return
    request.getfixturevalue("build")
    with ExitStack() as stack:
        yield stack.enter_context(ChipProcess(tmp_path / "tty", SPEED))


Install = Callable[..., Path]


@pytest.fixture
def from_pypi() -> Install:
    """Install packages next to, not into, this Python's own."""

    def get(name: str, *packages: str) -> Path:
        directory = checkout_root() / "build" / "senders" / name
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-warn-conflicts"]
        return install(name, [*pip, "--no-deps", "--target", str(directory), *packages], directory)

    return get


@pytest.fixture
def from_npm() -> Install:
    """Install packages of npm, without running their install scripts."""

    def get(name: str, *packages: str) -> Path:
        npm = shutil.which("npm")
        if npm is None or shutil.which("node") is None:
            missing(f"{name} needs node and npm")
        directory = checkout_root() / "build" / "senders" / name
        options = ["--no-audit", "--no-fund", "--ignore-scripts", "--omit=dev", "--loglevel=error"]
        return install(name, [npm, "install", "--prefix", str(directory), *options, *packages], directory)

    return get
