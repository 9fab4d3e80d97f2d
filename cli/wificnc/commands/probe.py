"""`wificnc probe Z-20`: move until the probe touches, and set the work zero there if wanted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rich_click as click

from wificnc import ui
from wificnc.commands._target import json_option, position_json, target_option
from wificnc.commands._words import one_axis
from wificnc.errors import Exit, JobError, RefusedError
from wificnc.job.resume import number
from wificnc.keyboard import Keyboard
from wificnc.link import realtime
from wificnc.link.client import Client, connected, error_words, expect_state, unit_mm
from wificnc.link.protocol import ProbeResult, parse_probe
from wificnc.link.rest import wait_rest
from wificnc.live import place

PROBING_S = 60.0


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("word", callback=one_axis, metavar="AXIS±DISTANCE")
@target_option
@click.option("--feed", type=click.FloatRange(min=0, min_open=True), default=100.0, show_default=True, help="mm/min.")
@click.option("--away", is_flag=True, help="Until contact is lost (G38.4), not until it is made (G38.2).")
@click.option("--set", "touch_mm", type=float, metavar="MM",
              help="The contact becomes this work coordinate: 0, or the thickness of a touch plate.")  # fmt: skip
@click.option("--retract", type=click.FloatRange(min=0), default=0.0, metavar="MM", help="Then go back so far.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, word: str, target: str, feed: float, away: bool, touch_mm: float | None, retract: float,
    as_json: bool,
) -> None:  # fmt: skip
    """Move an axis by at most this distance until the probe touches: `wificnc probe Z-20 --set 0 --retract 5`."""
    with connected(target) as client:
        expect_state(client, "Idle")
        client.synchronise()
        result = probe(client, word, feed, "G38.4" if away else "G38.2")
        scale = unit_mm(client.settings())
        if touch_mm is not None:
            set_coordinate(client, word[0], touch_mm, result, scale)
        if retract:
            back = -retract if float(word[1:]) > 0 else retract
            with relative_mm(client):
                client.must(f"G0{word[0]}{number(back)}")
            wait_rest(client)
        now = client.look_fully()
    if as_json:
        ui.emit_json(probe_json(result, now.wpos))
    else:
        ui.talk.print(f"contact at machine {place(result.position)}; now at {place(now.wpos)}")
    ctx.exit(Exit.OK)


def probe(client: Client, word: str, feed: float, code: str) -> ProbeResult:
    """One probing move. Raises RefusedError when nothing is touched."""
    with relative_mm(client), Keyboard() as keys:

        def stop_on_ctrl_c() -> None:
            if "\x03" in keys.read():
                client.send(realtime.RESET)

        answer = client.command(f"{code}{word}F{feed:g}", PROBING_S, keys.fds(), stop_on_ctrl_c)
    if answer.code:
        raise RefusedError(f"probing: {error_words(answer.code)}")
    found = [result for body in answer.brackets("PRB") if (result := parse_probe(body))]
    if not found or not found[-1].touched:
        raise JobError("the probe touched nothing, or the controller does not say where")
    return found[-1]


@contextmanager
def relative_mm(client: Client) -> Iterator[None]:
    """G91 G21 inside; outside the modes that were there before."""
    words = client.parser_state()
    client.must("G91G21")
    try:
        yield
    finally:
        if client.look().status.state == "Idle":
            client.must("".join([word for word in words if word in ("G20", "G90", "G0", "G1")] or ["G90", "G0"]))


def set_coordinate(client: Client, axis: str, touch_mm: float, result: ProbeResult, scale: float) -> None:
    """G10 L20 for the place of contact: the machine stands a little behind it."""
    at = "XYZABC".index(axis)
    beyond_mm = (client.look().mpos[at] - result.position[at]) * scale
    with relative_mm(client):  # for the unit; a coordinate is one in G91 too
        client.must(f"G10L20P0{axis}{number(touch_mm + beyond_mm)}")


def probe_json(result: ProbeResult, wpos: tuple[float, ...]) -> dict[str, Any]:
    return {"machine_position": position_json(result.position), "work_position_now": position_json(wpos)}
