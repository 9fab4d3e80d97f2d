"""`wificnc serve` of the PIC32MZ board as a program, with what a sender's test wants to know of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from image_fixture import BOARD
from patience import HANG_S

BASELINE = tuple(f"${base + ax}={value}" for base, value in ((100, 250), (110, 5000), (120, 500)) for ax in range(4))


class ChipProcess:
    """Serves from `with` to its end. `tcp` and `options.pty` as of wificnc.simulator.serve.server.Server."""

    def __init__(self, pty: Path, speed: float) -> None:
        self.options = SimpleNamespace(pty=pty)
        self.tcp = ""
        settings = [word for line in BASELINE for word in ("--set", line)]
        serve = [sys.executable, "-m", "wificnc", "serve", "--board", BOARD, "--tcp", "127.0.0.1:0"]
        self._command = [*serve, "--pty", str(pty), "--speed", str(speed), *settings]

    def __enter__(self) -> ChipProcess:
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout
        doors = dict(self._process.stdout.readline().split(maxsplit=1) for _ in range(2))
        self.tcp = doors["tcp"].strip()
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait(HANG_S)
        if self._process.stdout:
            self._process.stdout.close()
