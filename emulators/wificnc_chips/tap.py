"""A TAP device of Linux as the virtual chip's network: it is then a computer among others."""

from __future__ import annotations

import os
import struct
import sys
from contextlib import suppress

from wificnc.errors import ServeError

DEVICE = "/dev/net/tun"
NAME_MAX = 15
FRAME_MAX = 2048
IFF_TAP, IFF_NO_PI, TUNSETIFF = 0x0002, 0x1000, 0x400454CA

if sys.platform == "linux":
    import fcntl

    def _open(name: str) -> int:
        """Raises ServeError."""
        descriptor = -1
        try:
            descriptor = os.open(DEVICE, os.O_RDWR | os.O_NONBLOCK)
            fcntl.ioctl(descriptor, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TAP | IFF_NO_PI))
        except OSError as err:
            if descriptor >= 0:
                os.close(descriptor)
            raise ServeError(
                f"cannot use the TAP device {name}: {err.strerror}",
                hint=f"make it once: sudo ip tuntap add {name} mode tap user $USER; sudo ip link set {name} up",
            ) from err
        return descriptor
else:

    def _open(name: str) -> int:
        raise ServeError(f"cannot use the TAP device {name}: only Linux has them", hint="--network user")


class TapNetwork:
    """From its making to close(). Raises ServeError."""

    def __init__(self, name: str) -> None:
        if not 1 <= len(name.encode()) <= NAME_MAX or "/" in name:
            raise ServeError(f"{name!r} is not the name of a TAP device", hint="--network tap:tap0")
        self._descriptor = _open(name)

    def close(self) -> None:
        os.close(self._descriptor)

    def send(self, frame: bytes) -> None:
        """A frame of the chip. Where the device is down it is lost, as on a cable without an end."""
        with suppress(OSError):
            os.write(self._descriptor, frame)

    def receive(self, _now_ns: int) -> list[bytes]:
        """What has come for the chip."""
        frames: list[bytes] = []
        with suppress(OSError):  # nothing more; or it is down
            while True:
                frames.append(os.read(self._descriptor, FRAME_MAX))
        return frames
