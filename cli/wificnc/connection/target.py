"""How a controller is named: an address of the network or a serial port, with its scheme or without.

tcp://[:KEY@]HOST[:PORT]         192.168.1.20:23    wificnc-1a2b.local    [::1]:2323
serial://PORT[?baud=BAUD]        /dev/ttyUSB0       COM3                  ./cnc
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from urllib.parse import parse_qs, unquote

from wificnc.connection.port import BOARD_PORT, SERVE_PORT
from wificnc.errors import UserError
from wificnc.files.digits import whole_number

DEFAULT_BAUD = 115200
PORT_MAX = 65535
TARGET_HINT = f"write HOST:PORT, like 192.168.1.20:{BOARD_PORT}, or a serial port, like /dev/ttyUSB0 or COM3"

_SCHEME = re.compile(r"([a-z]+)://(.*)", re.IGNORECASE)
_SERIAL = re.compile(r"(?:/|\.{1,2}/|~/|\\\\\.\\|COM\d+(?:\?|$)).*", re.IGNORECASE)
_DEVICE = re.compile(r"(?:/dev/|\\\\\.\\|COM\d+(?:\?|$)).*", re.IGNORECASE)
_TTY = re.compile(r"(?:tty|cu\.|rfcomm)\w*.*")
_NAME = r"[A-Za-z0-9_](?:[A-Za-z0-9_.-]*[A-Za-z0-9_.])?"
_HOST = re.compile(rf"(?:\[(?P<six>[^\[\]]+)\]|(?P<name>{_NAME}))(?::(?P<port>\d+))?")
_COM = re.compile(r"COM\d+", re.IGNORECASE)


@dataclass(frozen=True)
class NetworkTarget:
    """A controller that listens at a TCP port."""

    host: str
    port: int
    key: str = ""


@dataclass(frozen=True)
class SerialTarget:
    """A controller at a serial port."""

    path: str
    baud: int = DEFAULT_BAUD


def parse_target(text: str) -> NetworkTarget | SerialTarget:
    """Raises UserError: it is not a target, or it may be two; the hint has the ways to write it."""
    text = text.strip()
    scheme = _SCHEME.fullmatch(text)
    if scheme is None:
        if _SERIAL.fullmatch(text):
            return _serial(text, text)
        _refuse_ambiguous(text)
        return _network(text, text)
    kind = scheme[1].lower()
    if kind == "serial":
        return _serial(text, scheme[2])
    if kind == "tcp":
        return _network(text, scheme[2])
    raise _invalid(text, f"{kind}:// is not supported")


def is_target(text: str) -> bool:
    """Whether this can be no name of a file: it has a scheme, a port or an address in numbers, or is a serial port."""
    if not (_SCHEME.match(text) or _DEVICE.fullmatch(text) or re.fullmatch(r".*\]|[^/\\]*:\d+|[\d.]+", text.strip())):
        return False
    try:
        parse_target(text)
    except UserError:
        return _SCHEME.match(text) is not None
    return True


def host_and_port(text: str, default_port: int) -> tuple[str, int]:
    """HOST[:PORT], where HOST may be an IPv6 address in brackets. Raises UserError."""
    return _host_and_port(text.strip(), text.strip(), default_port)


def _serial(text: str, place: str) -> SerialTarget:
    path, _, query = place.partition("?")
    options = parse_qs(query, keep_blank_values=True)
    baud = options.pop("baud", [str(DEFAULT_BAUD)])[-1]
    if not path:
        raise _invalid(text, "the serial port is missing")
    if options:
        raise _invalid(text, f"the only option of a serial port is baud, not {next(iter(options))}")
    if not re.fullmatch(r"0*[1-9]\d{0,7}", baud):
        raise _invalid(text, f"{baud!r} is not a baud rate")
    return SerialTarget(unquote(path), whole_number(baud))


def _network(text: str, place: str) -> NetworkTarget:
    user, at, address = place.rpartition("@")
    if at and not user.startswith(":"):
        raise _invalid(text, "an access key is written as :KEY@HOST, without a user name")
    host, port = _host_and_port(text, address, None)
    return NetworkTarget(host, port, unquote(user[1:]))


def is_this_computer(host: str) -> bool:
    """Whether only `wificnc serve` can be there, and no board."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _host_and_port(text: str, address: str, default_port: int | None) -> tuple[str, int]:
    """@param default_port: None: where a controller listens at that host"""
    found = _HOST.fullmatch(address)
    if found is None:
        raise _invalid(text, "it is neither HOST:PORT nor a serial port")
    host = found["six"] or found["name"]
    if found["six"]:
        _check(ipaddress.IPv6Address, text, host.partition("%")[0])
    elif re.fullmatch(r"[\d.]+", host):
        _check(ipaddress.IPv4Address, text, host)
    elif _COM.fullmatch(host):
        raise _invalid(text, f"{host} is a serial port, and those have no TCP port", f"{host} alone")
    if default_port is None:
        default_port = _port_at(host)
    port = default_port if found["port"] is None else whole_number(found["port"])
    if not 0 < port <= PORT_MAX:
        raise _invalid(text, f"a TCP port is 1 to {PORT_MAX}")
    return host, port


def _port_at(host: str) -> int:
    return SERVE_PORT if is_this_computer(host) else BOARD_PORT


def _check(kind: type[ipaddress.IPv4Address] | type[ipaddress.IPv6Address], text: str, host: str) -> None:
    try:
        kind(host)
    except ValueError as err:
        raise _invalid(text, str(err)) from err


def _refuse_ambiguous(text: str) -> None:
    """Raises UserError: a name that may be a host or a serial port, and numbers that may be a host with a port."""
    name = text.partition("?")[0]
    if _TTY.fullmatch(name):
        raise _invalid(text, "a serial port needs its whole name", f"/dev/{text}")
    if text != "localhost" and re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        ways = f"{name}.local or {name}:{BOARD_PORT} for a controller in the network, ./{name} for a serial port"
        raise _invalid(text, "it may be a host or a serial port", ways)
    if text.count(":") > 1 and re.fullmatch(r"[0-9A-Fa-f:.%]+", text):
        raise _invalid(text, "an IPv6 address needs brackets", f"[{text}]:{_port_at(text)}")


def _invalid(text: str, why: str, hint: str = TARGET_HINT) -> UserError:
    return UserError(f"invalid target {text!r}: {why}", hint=hint)
