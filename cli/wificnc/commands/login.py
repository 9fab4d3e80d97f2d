"""`wificnc login`: let the programs of this computer command a controller in the network."""

from __future__ import annotations

import ipaddress
import re
import time
from dataclasses import dataclass
from urllib.parse import quote

import rich_click as click

from wificnc import ui
from wificnc.commands._secret import READ, Secret
from wificnc.commands._target import json_option
from wificnc.connection.target import NetworkTarget, parse_target
from wificnc.connection.transport import SEND_TIMEOUT_S, Transport, open_transport
from wificnc.errors import LinkError, RefusedError, UserError

SPANS = ("day", "always", "no")
TRUST = re.compile(r"\[TRUST:(\d),([0-9a-f.:]+),(always|\d+)\]")
MESSAGE = re.compile(r"\[MSG:(.*(?:trust|TRUST).*)\]")


@dataclass(frozen=True)
class Trusted:
    """An address that needs no login."""

    number: int  # by which the controller is asked to end it
    address: str
    seconds: int | None  # None: for ever


@click.command()
@click.argument("target", metavar="HOST[:PORT]")
@click.option("--for", "span", type=click.Choice(SPANS), default="day", show_default=True,
              help="How long this computer's address is trusted; no: not any more.")  # fmt: skip
@click.option("--list", "lists", is_flag=True, help="List the trusted addresses instead.")
@click.option("--revoke", metavar="ADDRESS", help="End the trust in this address instead; all: in every one.")
@click.option("--key", type=Secret(), envvar="WIFICNC_KEY", show_envvar=True,
              help="The access key. Prompted for if not given. " + READ)  # fmt: skip
@json_option
def command(target: str, span: str, lists: bool, revoke: str | None, key: str | None, as_json: bool) -> None:
    """Log in to a controller, so that senders on this computer that cannot log in may command it.

    The access key is shown at each USB connection, and by `wificnc wifi status`. docs/security.md.
    """
    place = parse_target(target)
    if not isinstance(place, NetworkTarget):
        raise UserError(f"{target} is a serial port", hint="serial ports need no login")
    key = key or place.key or click.prompt("access key", hide_input=True, err=True)
    host = f"[{place.host}]" if ":" in place.host else place.host
    transport = open_transport(f"tcp://:{quote(key, safe='')}@{host}:{place.port}")
    try:
        if lists:
            show(trusted_by(transport), as_json)
        elif revoke is not None:
            ui.note(ask(transport, f"$TRUST={word_of(transport, revoke)}")[-1])
        else:
            ui.note(ask(transport, f"$TRUST={span}")[-1])
    finally:
        transport.close()


def show(trusted: list[Trusted], as_json: bool) -> None:
    if as_json:
        ui.emit_json([{"address": each.address, "seconds": each.seconds} for each in trusted])
        return
    for each in trusted:
        left = "always" if each.seconds is None else f"for {each.seconds / 3600:.1f} h"
        ui.data.print(f"{each.address}  {left}")
    if not trusted:
        ui.note("no address is trusted")


def trusted_by(transport: Transport) -> list[Trusted]:
    """The addresses that a controller trusts."""
    found = [match for line in ask(transport, "$TRUST") if (match := TRUST.fullmatch(line))]
    return [Trusted(int(each[1]), each[2], None if each[3] == "always" else int(each[3])) for each in found]


def same_address(listed: str, typed: str) -> bool:
    """However an IPv6 address is written."""
    try:
        return ipaddress.ip_address(listed) == ipaddress.ip_address(typed)
    except ValueError:
        return listed == typed


def word_of(transport: Transport, address: str) -> str:
    """What ends the trust in an address. Raises UserError: it is not trusted."""
    if address == "all":
        return "none"
    trusted = trusted_by(transport)
    for each in trusted:
        if same_address(each.address, address):
            return f"no {each.number}"
    known = ", ".join(each.address for each in trusted) or "none"
    raise UserError(f"{address} is not trusted", hint=f"trusted addresses: {known}")


def ask(transport: Transport, line: str) -> list[str]:
    """The controller's list, or what it says of the trust. Raises RefusedError, LinkError."""
    transport.send(f"{line}\n".encode())
    deadline, said = time.monotonic() + SEND_TIMEOUT_S, b""
    while time.monotonic() < deadline:
        lines = said.decode("utf-8", "replace").split("\r\n")
        about = [found[1] for each in lines if (found := MESSAGE.fullmatch(each))]
        if any(each.startswith("error:") for each in lines[:-1]):
            raise RefusedError(about[-1] if about else f"{transport.name} refuses {line}")
        if "ok" in lines[:-1] and (about or line == "$TRUST"):
            return about if line != "$TRUST" else lines
        transport.wait(deadline - time.monotonic())
        said += transport.receive()
    raise LinkError(f"{transport.name} does not answer $TRUST", hint="does its firmware have access keys?")
