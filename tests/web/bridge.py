"""A serial port for a browser without one: `navigator.serial` as a WebSocket, and what it leads to.

Headless Chromium has the Web Serial API and no port. stand_in() replaces the API by one port whose bytes go through a
WebSocket of this computer to a pty: `wificnc serve --pty`, or a mock of an ESP32's loader.
"""

from __future__ import annotations

import os
import select
import threading
import tty
from pathlib import Path

from patience import HANG_S
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

PORT_SCRIPT = """
(() => {
  class Port extends EventTarget {
    async open() {
      if (this.socket) throw new DOMException("The port is already open.", "InvalidStateError");
      const socket = new WebSocket("@URL@");
      socket.binaryType = "arraybuffer";
      await new Promise((resolve, reject) => {
        socket.onopen = resolve;
        socket.onerror = () => reject(new DOMException("Failed to open serial port.", "NetworkError"));
      });
      this.socket = socket;
      this.makeReadable();
      this.writable = new WritableStream({ write: (bytes) => this.send(bytes) });
    }
    send(bytes) {
      const open = this.socket && this.socket.readyState === WebSocket.OPEN;
      if (!open) throw new DOMException("The device has been lost.", "NetworkError");
      this.socket.send(bytes);
    }
    makeReadable() {
      const socket = this.socket;
      this.readable = new ReadableStream({
        start: (controller) => {
          socket.onmessage = (event) => controller.enqueue(new Uint8Array(event.data));
          socket.onclose = () => {
            try { controller.error(new DOMException("The device has been lost.", "NetworkError")); } catch {}
            this.lost = true;
            this.dispatchEvent(new Event("disconnect"));
          };
        },
        cancel: () => this.makeReadable(),
      });
    }
    async close() {
      if (this.readable?.locked || this.writable?.locked) throw new TypeError("Cannot close: a stream is locked.");
      const socket = this.socket;
      this.socket = this.readable = this.writable = null;
      if (socket) socket.onclose = null;
      socket?.close();
    }
    async forget() {}
    async setSignals(signals) { (window.serialSignals ??= []).push(signals); }
    async getSignals() {
      return { clearToSend: true, dataCarrierDetect: true, dataSetReady: true, ringIndicator: false };
    }
    getInfo() { return { usbVendorId: 0x10c4, usbProductId: 0xea60 }; }
  }
  let port = new Port();
  const serial = new EventTarget();
  serial.requestPort = async () => (port.lost ? (port = new Port()) : port);
  serial.getPorts = async () => [port];
  Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => serial });
})();
"""


class Bridge:
    """WebSockets that lead to ptys. One at a time."""

    def __init__(self) -> None:
        self._device: Path | None = None
        self._connections: set[ServerConnection] = set()
        self._changed = threading.Condition()
        self._unplugged = threading.Event()
        self._server: Server = serve(self._handle, "127.0.0.1", 0, max_size=None)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    def __enter__(self) -> Bridge:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()
        self._server.shutdown()
        self._thread.join()

    def stand_in(self, device: Path) -> str:
        """A script for the page, before its own: its only port leads to this device."""
        self._device = device
        port = self._server.socket.getsockname()[1]
        return PORT_SCRIPT.replace("@URL@", f"ws://127.0.0.1:{port}/")

    def unplug(self) -> None:
        """The port that is open is gone, and so is every one until plug(). No one reads the device any more then."""
        self._unplugged.set()
        with self._changed:
            for connection in list(self._connections):
                connection.close_socket()
            assert self._changed.wait_for(lambda: not self._connections, HANG_S)

    def plug(self) -> None:
        self._unplugged.clear()

    def _handle(self, connection: ServerConnection) -> None:
        if self._unplugged.is_set() or self._device is None:
            connection.close(1011, "unplugged")
            return
        with self._changed:
            self._connections.add(connection)
        fd = os.open(self._device, os.O_RDWR | os.O_NOCTTY)
        wake, waker = os.pipe()
        try:
            tty.setraw(fd)
            reader = threading.Thread(target=_read, args=(fd, wake, connection), daemon=True)
            reader.start()
            for message in connection:
                assert isinstance(message, bytes)
                _write(fd, message)
        except (ConnectionClosed, OSError):
            pass  # either end is gone
        finally:
            os.close(waker)
            reader.join()
            os.close(wake)
            os.close(fd)
            with self._changed:
                self._connections.discard(connection)
                self._changed.notify_all()


def _write(fd: int, data: bytes) -> None:
    while data:
        data = data[os.write(fd, data) :]


def _read(fd: int, wake: int, connection: ServerConnection) -> None:
    """Until the writing half ends, which closes the other end of wake."""
    try:
        while wake not in select.select([fd, wake], [], [])[0]:
            connection.send(os.read(fd, 4096))
    except (ConnectionClosed, OSError):
        pass  # either end is gone
