"""`wificnc unlock`: leave an alarm."""

from __future__ import annotations

import rich_click as click

from wificnc import ui
from wificnc.commands._target import controller_option
from wificnc.errors import LinkError
from wificnc.link import realtime
from wificnc.link.client import Client, Target, connected
from wificnc.link.protocol import Banner
from wificnc.link.transport import open_transport

BANNER_S = 5.0


@click.command()
@controller_option
@click.option("--reset", is_flag=True, help="Reset first (Ctrl-X): needed after some alarms, and to end a hold.")
def command(target: Target, reset: bool) -> None:
    """Leave an alarm without homing. The position may be wrong: look at the machine first."""
    if reset:
        reset_controller(target)
    with connected(target) as client:
        if client.now().status.state != "Alarm":
            ui.note(f"not locked: {client.now().state}")
            return
        client.synchronise()
        client.leave_alarm("$X", client.command("$X"))
        ui.note(f"unlocked: {client.look().state}")


def reset_controller(target: Target) -> None:
    """Ctrl-X, and wait for the banner. Raises LinkError."""
    client = Client(open_transport(str(target)))
    try:
        client.send(realtime.RESET)
        deadline = client.clock() + BANNER_S
        while client.clock() < deadline:
            client.wait(deadline - client.clock())
            if any(isinstance(message, Banner) for message in client.receive()):
                return
        raise LinkError(f"{client.transport.name} does not answer a reset")
    finally:
        client.close()
