"""Which serial port the board is at."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from serial.tools import list_ports

from wificnc.errors import FlashError

# USB vendors of boards: Espressif itself, and the makers of the bridges on boards.
VENDORS = {0x303A: "Espressif", 0x10C4: "CP210x", 0x1A86: "CH340", 0x0403: "FTDI", 0x067B: "PL2303"}


@dataclass(frozen=True)
class Port:
    """A serial port that can be a board's."""

    device: str
    title: str


def usb_ports() -> list[Port]:
    """Ports of USB devices that boards have."""
    return [
        Port(port.device, f"{VENDORS[port.vid]}: {port.description}")
        for port in sorted(list_ports.comports(), key=lambda port: port.device)
        if port.vid in VENDORS
    ]


def choose_port(given: str | None, found: Iterable[Port]) -> str:
    """The port that was given, or the only one there is. Raises FlashError."""
    if given is not None:
        return given
    ports = list(found)
    if not ports:
        raise FlashError(
            "this computer does not detect a board",
            hint="use a data cable (not a charging cable); `wificnc doctor` checks more; or give --port PORT",
        )
    if len(ports) > 1:
        names = "\n".join(f"  {port.device}  {port.title}" for port in ports)
        raise FlashError(f"several ports could be the board:\n{names}", hint="choose: --port PORT")
    return ports[0].device
