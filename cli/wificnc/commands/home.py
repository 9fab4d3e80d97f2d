"""`wificnc home`: the homing cycle."""

from __future__ import annotations

import rich_click as click

from wificnc import ui
from wificnc.commands._target import controller_option, json_option
from wificnc.commands.status import status_json
from wificnc.connection import realtime
from wificnc.connection.client import Client, Target, connected, expect_state
from wificnc.keyboard import Keyboard
from wificnc.live import place

HOMING_S = 60.0  # of silence: Grbl reports nothing while it homes


@click.command()
@click.argument("axes", nargs=-1, type=click.Choice(list("XYZABC"), case_sensitive=False))
@controller_option
@json_option
def command(axes: tuple[str, ...], target: Target, as_json: bool) -> None:
    """Run the homing cycle, of all axes or of these. Ctrl-C resets the controller, which stops the axes immediately."""
    with connected(target) as client:
        expect_state(client, "Idle", "Alarm")
        client.synchronise()
        for axis in axes or ("",):
            home(client, f"$H{axis.upper()}")
        now = client.look_fully()
    if as_json:
        ui.emit_json(status_json(str(target), now))
    else:
        ui.talk.print(f"homed, machine position {place(now.mpos)}")


def home(client: Client, line: str) -> None:
    """One cycle. Raises RefusedError."""
    with Keyboard() as keys:

        def stop_on_ctrl_c() -> None:
            if "\x03" in keys.read():
                client.send(realtime.RESET)

        answer = client.command(line, HOMING_S, keys.fds(), stop_on_ctrl_c)
    client.leave_alarm(line, answer)
