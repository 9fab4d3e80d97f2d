"""`wificnc serve --on-chip` of an ESP32's real image with Ethernet, for senders over its own TCP.

Where: WIFICNC_ESP_ETHERNET is what `--on-chip` takes, WIFICNC_ESP_BOARD its board or board file. Images are made with
ESP-IDF, so these tests run where someone has one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from patience import HANG_S

IMAGE, BOARD = os.environ.get("WIFICNC_ESP_ETHERNET", ""), os.environ.get("WIFICNC_ESP_BOARD", "")
BASELINE = tuple(f"${base + ax}={value}" for base, value in ((100, 250), (110, 5000), (120, 500)) for ax in range(4))
COMES = "is the image's address"


class EspProcess:
    """Serves from `with` to its end. `tcp` and `options` as of wificnc.simulator.serve.server.Server."""

    def __init__(self, folder: Path, *options: str, speed: float = 1.0) -> None:
        self.options = SimpleNamespace(pty=folder / "tty", key="")
        self.doors: dict[str, str] = {}
        self._log = folder / "serve.log"
        settings = [word for line in BASELINE for word in ("--set", line)]
        serve = [sys.executable, "-m", "wificnc", "serve", "--board", BOARD, "--on-chip", IMAGE, "--network", "user"]
        doors = ["--tcp", "127.0.0.1:0", "--http", "127.0.0.1:0", "--control", "0", "--pty", str(self.options.pty)]
        self._command = [*serve, *doors, "--speed", str(speed), *settings, *options]

    def __enter__(self) -> EspProcess:
        log = self._log.open("w")
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=log, text=True)
        log.close()
        assert self._process.stdout
        for line in self._process.stdout:
            name, _, where = line.strip().partition(" ")
            self.doors[name] = where.strip()
            if name == "key":
                break
        assert "key" in self.doors, self._log.read_text()
        self.options.key = self.doors["key"].partition(",")[0]
        while COMES not in self._log.read_text():
            assert self._process.poll() is None, self._log.read_text()
        return self

    @property
    def tcp(self) -> str:
        return self.doors["tcp"]

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait(HANG_S)
        assert self._process.stdout
        self._process.stdout.close()
