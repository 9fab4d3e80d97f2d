"""`wificnc serve` of the PIC32MZ board: the real image at a TCP port and at a pseudo-terminal."""

from __future__ import annotations

import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc.build.pic32mz import Pic32Build
from wificnc.errors import Exit

ROOT = Path(__file__).resolve().parents[2]

# Two rounds of lines and an arc, at the default acceleration.
JOB = "G21G90G17\n" + "G1X10F300\nG2X15Y5I0J5\nG1Y10\nX0\nY0\n" * 2 + "M30\n"


@contextmanager
def serving(*options: str) -> Iterator[dict[str, str]]:
    """A server, and where it listens."""
    command = [sys.executable, "-m", "wificnc", "serve", "--board", "pic32mz2048efh100", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT)
    try:
        assert process.stdout
        wanted = 2 if "--pty" in options else 1
        doors = dict(process.stdout.readline().split(maxsplit=1) for _ in range(wanted))
        yield doors
    finally:
        process.terminate()
        process.wait(HANG_S)
        if process.stdout:
            process.stdout.close()


class Wire:
    """A descriptor to talk at."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self.said = b""

    def write(self, text: str) -> None:
        os.write(self._descriptor, text.encode("latin-1"))

    def until(self, wanted: bytes) -> bytes:
        """What is answered up to and with this."""
        deadline = time.monotonic() + HANG_S
        while wanted not in self.said:
            assert time.monotonic() < deadline, self.said
            ready, _, _ = select.select([self._descriptor], [], [], 1.0)
            self.said += os.read(self._descriptor, 4096) if ready else b""
        end = self.said.index(wanted) + len(wanted)
        said, self.said = self.said[:end], self.said[end:]
        return said


@contextmanager
def connected(address: str) -> Iterator[Wire]:
    host, port = address.split(":")
    with socket.create_connection((host, int(port)), HANG_S) as client:
        client.setblocking(True)
        yield Wire(client.fileno())


@pytest.mark.deep
def test_a_job_by_tcp(build: Pic32Build, tmp_path: Path) -> None:
    """A job, streamed by our own sender, as fast as the computer can."""
    job = tmp_path / "job.nc"
    job.write_text(JOB)
    with serving("--tcp", "127.0.0.1:0", "--speed", "max", "--set", "$110=8000", "--set", "$120=500") as doors:
        target = f"tcp://{doors['tcp'].strip()}"
        command = [sys.executable, "-m", "wificnc", "send", str(job), "--to", target]
        run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False)
        assert run.returncode == Exit.OK, run.stdout + run.stderr
        with connected(doors["tcp"].strip()) as wire:
            wire.write("$$\n")
            assert b"$110=8000.000\r\n" in wire.until(b"ok\r\n")


def test_pty_and_tcp_are_one_wire(build: Pic32Build, tmp_path: Path) -> None:
    link = tmp_path / "serial"
    with serving("--tcp", "127.0.0.1:0", "--pty", str(link)) as doors, connected(doors["tcp"].strip()) as wire:
        port = os.open(link, os.O_RDWR | os.O_NOCTTY)
        try:
            serial = Wire(port)
            serial.write("\n")  # when it is answered, the banner of the power-on is no longer to come
            assert serial.until(b"ok\r\n") and wire.until(b"ok\r\n")
            serial.write("\x18")
            assert b"Grbl 1.1h" in serial.until(b"help]\r\n") and wire.until(b"help]\r\n")
            wire.write("G91G1X1F600\n")
            assert serial.until(b"ok\r\n") and wire.until(b"ok\r\n")
            serial.write("?")
            assert b"<Run|" in serial.until(b">")
        finally:
            os.close(port)
    assert not link.is_symlink()


def test_settings_are_kept_in_a_file(build: Pic32Build, tmp_path: Path) -> None:
    """The file is the settings' two pages of flash."""
    store = tmp_path / "store.bin"
    for line, wanted in (("$100=321", b""), ("", b"$100=321.000\r\n")):
        with (
            serving("--tcp", "127.0.0.1:0", "--settings", str(store)) as doors,
            connected(doors["tcp"].strip()) as wire,
        ):
            wire.write(line + "\n$$\n")
            said = wire.until(b"ok\r\n") + wire.until(b"ok\r\n")
            assert wanted in said
    assert store.stat().st_size == 0xC000


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--set", "$0=2000"], "the controller refuses $0=2000"),
        (["--wmc3", "127.0.0.1"], "--wmc3 needs the image's Ethernet, which is not there"),
        (["--tcp", "256.0.0.1:0"], "cannot listen at"),
    ],
)
def test_what_cannot_be_served(build: Pic32Build, options: list[str], said: str) -> None:
    command = [sys.executable, "-m", "wificnc", "serve", "--board", "pic32mz2048efh100", *options]
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False)
    assert run.returncode == Exit.DEVICE and said in run.stderr, run.stderr
    assert "Traceback" not in run.stderr


def test_a_name_that_is_taken(build: Pic32Build, tmp_path: Path) -> None:
    link = tmp_path / "serial"
    link.write_text("mine")
    command = [sys.executable, "-m", "wificnc", "serve", "--board", "pic32mz2048efh100", "--pty", str(link), "--tcp"]
    run = subprocess.run(
        [*command, "127.0.0.1:0"], capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False
    )
    assert run.returncode == Exit.DEVICE and "the name is already in use" in run.stderr
    assert link.read_text() == "mine"
