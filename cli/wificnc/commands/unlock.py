"""`wificnc unlock`: end an alarm without homing."""

from __future__ import annotations

import rich_click as click

from wificnc import ui
from wificnc.commands._target import controller_option, json_option
from wificnc.commands.status import status_json
from wificnc.connection import realtime
from wificnc.connection.client import TAKE_OVER, Client, Target, connected, who_commands
from wificnc.connection.grbl import Banner
from wificnc.connection.transport import open_transport
from wificnc.errors import LinkError, RefusedError

BANNER_S = 5.0
HELD = ("Hold", "Tool", "Door", "Sleep")  # no line is read, and `$X` does not end it


@click.command()
@controller_option
@click.option("--reset", is_flag=True, help="Reset first (Ctrl-X): required after some alarms, and to end a hold.")
@json_option
def command(target: Target, reset: bool, as_json: bool) -> None:
    """Leave an alarm without homing. The position may be wrong: look at the machine first.

    In a hold, with an open door and in sleep there is nothing to unlock: exit code 1, with the next step.
    """
    if reset:
        reset_controller(target)
    with connected(target) as client:
        now = client.now()
        if now.status.state in HELD:
            found = client.condition()
            raise RefusedError(f"not locked, but in state {now.state}: {found.why}", hint=found.next)
        is_locked = now.status.state == "Alarm"
        if is_locked:
            client.synchronise()
            client.leave_alarm("$X", client.command("$X"))
        now = client.look_fully()
    ui.note(f"{'unlocked' if is_locked else 'not locked'}: {now.state}")
    if as_json:
        ui.emit_json(status_json(str(target), now))


def reset_controller(target: Target) -> None:
    """Ctrl-X, and wait for the banner.

    Raises:
        LinkError: there is none.
        RefusedError: another client is in control, or the controller is locked: it takes no reset of ours.
    """
    client = Client(open_transport(str(target)))
    try:
        client.send((TAKE_OVER if target.take else b"") + realtime.RESET)
        deadline = client.clock() + BANNER_S
        while client.clock() < deadline:
            client.wait(deadline - client.clock())
            for message in client.receive():
                if isinstance(message, Banner):
                    return
                if not (target.take and who_commands(message)):
                    client.expect_control(message)
        raise LinkError(
            f"{client.transport.name} does not answer a reset", hint="check that it is a controller, and its baud rate"
        )
    finally:
        client.close()
