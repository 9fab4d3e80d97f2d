"""`wificnc probe Z-20`: move until the probe touches, and set the work zero there if wanted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rich_click as click

from wificnc import ui
from wificnc.commands._finite import FINITE, FiniteRange
from wificnc.commands._target import controller_option, json_option, position_json
from wificnc.commands._words import one_axis
from wificnc.connection import realtime
from wificnc.connection.client import Client, Target, connected, error_words, expect_state, unit_mm
from wificnc.connection.grbl import ProbeResult, parse_probe
from wificnc.connection.rest import wait_rest
from wificnc.errors import Exit, JobError, RefusedError, UserError
from wificnc.job.resume import number
from wificnc.keyboard import Keyboard
from wificnc.live import place

PROBING_S = 60.0


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("word", callback=one_axis, metavar="AXIS±DISTANCE")
@controller_option
@click.option("--feed", type=FiniteRange(min=0, min_open=True), default=100.0, show_default=True, help="mm/min.")
@click.option("--away", is_flag=True, help="Move until contact is lost (G38.4), not until it is made (G38.2).")
@click.option("--set", "touch_mm", type=FINITE, metavar="MM",
              help="Work coordinate of the contact: 0, or the thickness of a touch plate.")  # fmt: skip
@click.option("--retract", type=FiniteRange(min=0), default=0.0, metavar="MM", help="Then retract by this distance.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, word: str, target: Target, feed: float, away: bool, touch_mm: float | None, retract: float,
    as_json: bool,
) -> None:  # fmt: skip
    """Move an axis by at most this distance until the probe touches: `wificnc probe Z-20 --set 0 --retract 5`."""
    axis, distance_mm = word[0], float(word[1:])
    with connected(target) as client:
        expect_state(client, "Idle")
        client.synchronise()
        bench = Bench(client, axis)
        with bench.absolute_mm():
            result = bench.probe(distance_mm, feed, "G38.4" if away else "G38.2")
            if touch_mm is not None:
                bench.set_coordinate(touch_mm, result)
            if retract:
                bench.move(-retract if distance_mm > 0 else retract)
        now = client.look_fully()
    if as_json:
        ui.emit_json(probe_json(result, now.wpos))
    else:
        ui.talk.print(f"contact at machine {place(result.position)}; now at {place(now.wpos)}")
    ctx.exit(Exit.OK)


class Bench:
    """One axis under the probe. All moves are to absolute places, so that a move that fails leaves G90 behind."""

    def __init__(self, client: Client, axis: str) -> None:
        self.client = client
        self.axis = axis
        self.index = "XYZABC".index(axis)
        self.unit = unit_mm(client.settings()) if axis in "XYZ" else 1.0
        if self.index >= len(client.now().mpos):
            raise UserError(f"this machine has no axis {axis}")

    @contextmanager
    def absolute_mm(self) -> Iterator[None]:
        """G90 G21 inside; outside the modes that were there before."""
        before = [word for word in self.client.parser_state() if word in ("G20", "G91", "G0", "G1")]
        self.client.must("G90G21")
        try:
            yield
        finally:
            if before and self.client.look().status.state == "Idle":
                self.client.must("".join(before))

    def place_mm(self, distance_mm: float) -> str:
        """The word for a place so far from here."""
        here = self.client.look_fully().wpos[self.index] * self.unit
        return f"{self.axis}{number(here + distance_mm)}"

    def probe(self, distance_mm: float, feed: float, code: str) -> ProbeResult:
        """One probing move. Raises RefusedError when nothing is touched. Ctrl-C resets."""
        with Keyboard() as keys:

            def stop_on_ctrl_c() -> None:
                if "\x03" in keys.read():
                    self.client.send(realtime.RESET)

            line = f"{code}{self.place_mm(distance_mm)}F{feed:g}"
            answer = self.client.command(line, PROBING_S, keys.fds(), stop_on_ctrl_c)
        if answer.code:
            raise RefusedError(f"probing: {error_words(answer.code)}")
        found = [result for body in answer.brackets("PRB") if (result := parse_probe(body))]
        if not found or not found[-1].touched:
            raise JobError("the probe made no contact, or the controller does not report its position")
        return found[-1]

    def set_coordinate(self, touch_mm: float, result: ProbeResult) -> None:
        """G10 L20 for the place of contact: the machine is a little behind it."""
        beyond_mm = (self.client.look().mpos[self.index] - result.position[self.index]) * self.unit
        self.client.must(f"G10L20P0{self.axis}{number(touch_mm + beyond_mm)}")

    def move(self, distance_mm: float) -> None:
        self.client.must(f"G0{self.place_mm(distance_mm)}")
        wait_rest(self.client)


def probe_json(result: ProbeResult, wpos: tuple[float, ...]) -> dict[str, Any]:
    return {"machine_position": position_json(result.position), "work_position_now": position_json(wpos)}
