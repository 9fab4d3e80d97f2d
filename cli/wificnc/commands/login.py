"""`wificnc login`: let the programs of this computer command a controller in the network."""

from __future__ import annotations

import time
from urllib.parse import quote

import rich_click as click

from wificnc import ui
from wificnc.errors import LinkError, RefusedError, UserError
from wificnc.link.target import NetworkTarget, parse_target
from wificnc.link.transport import SEND_TIMEOUT_S, Transport, open_transport

SPANS = ("day", "always", "no")
TRUSTED, REFUSED = (b"is not trusted", b"are trusted"), (b"no trust", b"needs trust", b"Too many", b"$TRUST is")


@click.command()
@click.argument("target", metavar="HOST[:PORT]")
@click.option("--for", "span", type=click.Choice(SPANS), default="day", show_default=True,
              help="How long this computer's address is trusted; no: not any more.")  # fmt: skip
@click.option("--key", envvar="WIFICNC_KEY", show_envvar=True, help="The access key. Prompted for if not given.")
def command(target: str, span: str, key: str | None) -> None:
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
        transport.send(f"$TRUST={span}\n".encode())
        ui.note(answer_of(transport))
    finally:
        transport.close()


def answer_of(transport: Transport) -> str:
    """What the controller says of the trust. Raises RefusedError, LinkError."""
    deadline, said = time.monotonic() + SEND_TIMEOUT_S, b""
    while time.monotonic() < deadline:
        for line in said.split(b"\r\n"):
            words = line.removeprefix(b"[MSG:").removesuffix(b"]").decode("utf-8", "replace")
            if any(word in line for word in TRUSTED):
                return words
            if any(word in line for word in REFUSED):
                raise RefusedError(words)
        transport.wait(deadline - time.monotonic())
        said += transport.receive()
    raise LinkError(f"{transport.name} does not answer $TRUST", hint="does its firmware have access keys?")
