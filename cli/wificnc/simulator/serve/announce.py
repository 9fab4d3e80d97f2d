"""The page of a served controller in multicast DNS: under which name and address the network finds it."""

from __future__ import annotations

import ctypes
import ipaddress
import re
import socket
import uuid
from ctypes import c_char, c_uint8, c_uint16, c_uint32

from wificnc.simulator.serve.options import Address

EVERYWHERE = Address("0.0.0.0", 5353)  # where questions of the network arrive
GROUP = ("224.0.0.251", 5353)
NAME_MAX = 31  # NET_MDNS_NAME of targets/net/net_mdns.h, without its NUL


class Announced(ctypes.Structure):
    """struct net_mdns"""

    _fields_ = (
        ("name", c_char * 32),
        ("id", c_char * 32),
        ("board", c_char * 64),
        ("address", c_uint8 * 4),
        ("telnet_port", c_uint16),
        ("http_port", c_uint16),
        ("answers", c_uint16),
        ("second_us", c_uint32),
    )


def announced(where: Address, port: int, board: str) -> Announced | None:
    """None: no other computer of an IPv4 network reaches the page there. @param port  that was got"""
    address = _own_address() if where.host == "0.0.0.0" else where.host
    try:
        found = ipaddress.IPv4Address(address)
    except ValueError:
        return None
    if found.is_loopback:
        return None
    computer = re.sub(r"[^A-Za-z0-9-]+", "-", socket.gethostname().partition(".")[0])
    name = f"WiFiCNC-{computer}"[: NAME_MAX - 6] + f"-{port}"  # two controllers on one computer have two names
    quads = (c_uint8 * 4)(*found.packed)
    return Announced(name.encode(), f"{uuid.getnode():012x}-{port}".encode(), board.encode()[:63], quads, 0, port)


def _own_address() -> str:
    """Of the network that multicast goes to; "": there is none. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(GROUP)
        except OSError:
            return ""
        address: str = asking.getsockname()[0]
        return address
