"""Senders that people use, against `wificnc serve`: each connects, reads the settings, streams a job to its end, and
both sides agree where the machine is."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from esp_process import EspProcess
from installed import missing
from job import write_job
from patience import HANG_S
from relay import Relay
from serve_chip import ChipProcess
from serve_peer import Peer, stream
from wificnc.commands.login import command as login
from wificnc.simulator.serve.server import Server

HERE = Path(__file__).parent
LOCKED = "[MSG:Locked: log in at the web page, by wificnc login, or send $LOGIN=access key]"


def drive(argv: list[str], packages: Path | None = None) -> dict[str, Any]:
    """Run a driver to its end. Its last line is what the sender saw."""
    environment = {**os.environ, **({"PYTHONPATH": str(packages)} if packages else {})}
    run = subprocess.run(argv, capture_output=True, text=True, timeout=HANG_S, env=environment)
    assert run.returncode == 0, f"{run.stdout[-3000:]}\n{run.stderr[-3000:]}"
    result: dict[str, Any] = json.loads(run.stdout.strip().splitlines()[-1])
    return result


def check(server: Server | ChipProcess | EspProcess, saw: dict[str, Any], end: list[float]) -> None:
    """No error on the way; the sender's position, the controller's, and the program's end are one."""
    assert server.tcp
    assert saw["errors"] == []
    assert saw.get("steps_per_mm", 250.0) == 250.0
    assert saw["position"][:3] == end
    with Peer.tcp(server.tcp) as watcher:
        assert watcher.idle_position_mm()[:3] == end


def test_plain_character_counting(server: Server | EspProcess, tmp_path: Path) -> None:
    end = write_job(tmp_path / "job.nc")
    assert server.options.pty
    with Peer.serial(server.options.pty) as peer:
        lines = (tmp_path / "job.nc").read_text().splitlines()
        assert stream(peer, lines, 127) == ["ok"] * len(lines)
        assert peer.idle_position_mm()[:3] == end


def run_job(
    server: Server | ChipProcess | EspProcess,
    tmp_path: Path,
    command: Callable[[str], list[str]],
    packages: Path | None = None,
) -> tuple[Any, Any]:
    """What a sender shows of a controller that is locked, if it is; and what it saw of a job to its end, which it runs
    at a serial port, or over the network after one login from its computer."""
    end, shown = write_job(tmp_path / "job.nc"), None
    with ExitStack() as stack:
        port = str(server.options.pty)
        if not isinstance(server, ChipProcess) and server.options.key:
            assert server.tcp
            with Relay(server.tcp) as relay:
                shown = drive(command(relay.path), packages)
            login.main([server.tcp, "--key", server.options.key], standalone_mode=False)
            port = stack.enter_context(Relay(server.tcp)).path
        saw = drive([*command(port), str(tmp_path / "job.nc")], packages)
    check(server, saw, end)
    return shown, saw


@pytest.mark.slow
def test_grbl_streamer(server: Server | EspProcess, tmp_path: Path, from_pypi: Callable[..., Path]) -> None:
    packages = from_pypi("grbl-streamer", "grbl-streamer==2.0.2", "gcode-machine==1.0.3", "pyserial==3.5")
    driver = str(HERE / "drive_grbl_streamer.py")
    shown, _ = run_job(server, tmp_path, lambda port: [sys.executable, driver, port], packages)
    assert shown is None or shown[0] == "error:180"  # it shows no messages


@pytest.mark.slow
def test_bcnc_sender(server: Server | EspProcess, tmp_path: Path, from_pypi: Callable[..., Path]) -> None:
    if importlib.util.find_spec("tkinter") is None:
        missing("bCNC's modules import tkinter (Debian: apt-get install python3-tk)")
    packages = from_pypi(
        "bcnc", "bCNC==0.9.16", "pyserial==3.5", "svgelements==1.9.6", "shxparser==0.0.2", "Pillow", "numpy"
    )
    driver = str(HERE / "drive_bcnc.py")
    shown, _ = run_job(server, tmp_path, lambda port: [sys.executable, driver, str(packages), port], packages)
    assert shown is None or {LOCKED, "error:180"} <= set(shown)


@contextmanager
def cncjs_server(directory: Path, scratch: Path) -> Iterator[str]:
    """A CNCjs server on a free port of this computer; its configuration and home are in scratch."""
    program = directory / "node_modules" / "cncjs" / "bin" / "cncjs"
    node = shutil.which("node")
    assert node
    argv = [node, str(program), "--host", "127.0.0.1", "--port", "0", "--config", str(scratch / "cncrc.json")]
    environment = {**os.environ, "HOME": str(scratch), "NODE_ENV": "production"}
    process = subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        assert process.stdout
        said = []
        for line in process.stdout:
            said.append(line)
            if found := re.search(r"(http://127\.0\.0\.1:\d+)", line):
                yield found[1]
                return
        pytest.fail("CNCjs ended: " + "".join(said[-20:]))
    finally:
        process.terminate()
        process.communicate(timeout=HANG_S)


@pytest.mark.slow
def test_cncjs(server: Server | EspProcess, tmp_path: Path, from_npm: Callable[..., Path]) -> None:
    directory = from_npm("cncjs", "cncjs@1.11.5")
    with cncjs_server(directory, tmp_path) as url:
        driver = str(HERE / "drive_cncjs.js")
        shown, saw = run_job(server, tmp_path, lambda port: ["node", driver, str(directory), url, port])
    assert shown is None or {LOCKED, "error:180"} <= set(shown)
    total, sent, received = saw["lines"]
    assert total == sent == received
    assert saw["modal"]["motion"] in ("G0", "G1")
