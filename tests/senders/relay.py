"""A pseudo-terminal that is a TCP connection, as socat or a driver of network serial ports makes it: for senders that
open serial ports only."""

from __future__ import annotations

import os
import select
import socket
import threading
import tty
from types import TracebackType

from patience import HANG_S

PIECE = 4096


class Relay:
    """`path` is the port; the connection begins and ends with this."""

    def __init__(self, tcp: str) -> None:
        host, _, port = tcp.rpartition(":")
        self._socket = socket.create_connection((host.strip("[]"), int(port)), HANG_S)
        self._inside, self._outside = os.openpty()
        tty.setraw(self._inside)
        tty.setraw(self._outside)
        self.path = os.ttyname(self._outside)
        self._ends, self._end = os.pipe()
        self._thread = threading.Thread(target=self._pass_on)

    def __enter__(self) -> Relay:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._end)
        self._thread.join()
        self._socket.close()
        for each in (self._inside, self._outside, self._ends):
            os.close(each)

    def _pass_on(self) -> None:
        network = self._socket.fileno()
        while self._ends not in (ready := select.select([network, self._inside, self._ends], [], [])[0]):
            if self._inside in ready:
                self._socket.sendall(os.read(self._inside, PIECE))
            if network in ready:
                data = os.read(network, PIECE)
                if not data:
                    return
                while data:
                    data = data[os.write(self._inside, data) :]
