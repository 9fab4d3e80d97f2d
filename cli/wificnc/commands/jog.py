"""`wificnc jog X10 Y-5`: move a machine by hand."""

from __future__ import annotations

import rich_click as click

from wificnc import ui
from wificnc.commands._finite import FiniteRange
from wificnc.commands._target import controller_option, json_option
from wificnc.commands._words import some_axes
from wificnc.commands.status import status_json
from wificnc.connection import realtime
from wificnc.connection.client import Target, connected, expect_state
from wificnc.connection.rest import wait_rest
from wificnc.keyboard import Keyboard
from wificnc.live import place


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("words", nargs=-1, required=True, callback=some_axes, metavar="AXIS±DISTANCE...")
@controller_option
@click.option("--feed", type=FiniteRange(min=0, min_open=True), default=500.0, show_default=True, help="mm/min.")
@click.option("--absolute", is_flag=True, help="To this position in work coordinates, not by this distance.")
@click.option("--machine", is_flag=True, help="To this position in machine coordinates.")
@click.option("--inch", is_flag=True, help="Distances and feed are in inches.")
@json_option
def command(
    words: tuple[str, ...], target: Target, feed: float, absolute: bool, machine: bool, inch: bool, as_json: bool
) -> None:
    """Move by a distance: `wificnc jog X10 Z-0.5`. Returns when the axes have stopped; Ctrl-C stops them."""
    mode = "G53" if machine else "G90" if absolute else "G91"
    line = f"$J={mode}{'G20' if inch else 'G21'}{''.join(words)}F{feed:g}"
    with connected(target) as client, Keyboard() as keys:
        expect_state(client, "Idle")
        client.synchronise()
        client.must(line)
        now = wait_rest(client, realtime.JOG_CANCEL, lambda: "\x03" in keys.read(), keys.fds())
    if as_json:
        ui.emit_json(status_json(str(target), now))
    else:
        ui.talk.print(f"at {place(now.wpos)}")
