"""A served controller whose bus is a serial port: a pty with a drive at its other end, in real time."""

from __future__ import annotations

import os
import threading
import time
import tty
from collections.abc import Iterator

import pytest
from drives import Drive, Yl620, crc16
from patience import HANG_S
from serve_peer import Peer
from wificnc.board.load import load_board
from wificnc.errors import ServeError
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a pty plays the serial port")
SETTINGS = ("$30=24000", "$395=5", "$375=250", "$340=10", "$110=5000", "$120=500")


class Line:
    """The drive's end of the line; a request is whole when its CRC is right."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self._slave = slave
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        data = b""
        while True:
            try:
                data += os.read(self._master, 64)
            except OSError:
                return
            if len(data) >= 4 and data[-2:] == crc16(data[:-2]):
                for _, answer in self.drive.hear(time.monotonic(), data, self.drive.baud, self.drive.parity):
                    os.write(self._master, answer)
                data = b""

    def close(self) -> None:
        os.close(self._slave)
        os.close(self._master)
        self._thread.join(HANG_S)


@pytest.fixture
def drive() -> Drive:
    return Yl620()


@pytest.fixture
def line(drive: Drive) -> Iterator[Line]:
    made = Line(drive)
    yield made
    made.close()


def options(port: str | None) -> ServeOptions:
    from pathlib import Path

    return ServeOptions(
        board=load_board("host"),
        tcp=Address("127.0.0.1", 0),
        spindle_bus=Path(port) if port else None,
        settings=SETTINGS,
    )


def test_a_job_and_a_cable_that_is_cut(line: Line, drive: Drive) -> None:
    with Server(options(line.port)) as server:
        assert server.tcp
        with Peer.tcp(server.tcp) as peer:
            peer.send("M3S12000\nG91G1X2F600\nG4P0\n")
            for _ in range(3):
                peer.until("^ok$")
            assert drive.direction == 1 and drive.motor.rpm(time.monotonic()) == pytest.approx(12000, abs=8)
            peer.send("?")
            peer.until(r"FS:\d+,12000,1\d{4}")
            peer.send("G1X500\n")
            peer.until("^ok$")
            drive.silent = True
            peer.until("Spindle drive 1: no answer")
            peer.until("^ALARM:53$")
            drive.silent = False
            peer.until("answers again: stopped")
            assert drive.direction == 0


def test_a_port_that_does_not_exist() -> None:
    with pytest.raises(ServeError, match="--spindle-bus /dev/none"), Server(options("/dev/none")):
        pass
