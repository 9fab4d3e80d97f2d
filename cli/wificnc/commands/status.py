"""`wificnc status`: where a machine stands and what it does."""

from __future__ import annotations

from typing import Any

import rich_click as click
from rich.table import Table

from wificnc import ui
from wificnc.commands._target import json_option, position_json, target_option
from wificnc.link.client import Snapshot, connected
from wificnc.live import STATE_STYLES, place

PINS = {
    "P": "probe", "D": "door", "R": "reset", "H": "feed hold", "S": "cycle start",
    **{axis: f"limit {axis}" for axis in "XYZABC"},
}  # fmt: skip
ACCESSORIES = {"S": "spindle clockwise", "C": "spindle counter-clockwise", "F": "flood coolant", "M": "mist coolant"}


@click.command()
@target_option
@json_option
def command(target: str, as_json: bool) -> None:
    """Show where a machine stands and what it does. Works at any time, also while a job runs."""
    with connected(target) as client:
        now = client.look_fully()
    if as_json:
        ui.emit_json(status_json(target, now))
        return
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    table.add_row("state", f"[{STATE_STYLES.get(now.status.state, 'default')}]{now.state}[/]")
    for name, text in status_rows(now):
        table.add_row(name, text)
    ui.data.print(table)


def status_rows(now: Snapshot) -> list[tuple[str, str]]:
    """What the report says, in words; nothing of what it leaves out."""
    status = now.status
    rows = [("work", place(now.wpos)), ("machine", place(now.mpos))]
    if status.feed is not None:
        rows.append(("feed", f"{status.feed:g}"))
    if status.speed is not None:
        rows.append(("spindle", f"{status.speed:g}"))
    if now.overrides:
        feed, rapid, spindle = now.overrides
        rows.append(("overrides", f"feed {feed} %, rapid {rapid} %, spindle {spindle} %"))
    if now.accessories:
        rows.append(("on", ", ".join(ACCESSORIES.get(letter, letter) for letter in now.accessories)))
    if status.pins:
        rows.append(("active", ", ".join(PINS.get(letter, letter) for letter in status.pins)))
    if status.line is not None:
        rows.append(("line", str(status.line)))
    if status.rx_free is not None:
        rows.append(("free", f"{status.planner_free} moves, {status.rx_free} bytes"))
    return rows


def status_json(target: str, now: Snapshot) -> dict[str, Any]:
    """The document of --json; null is what the controller does not say. The keys are a contract with scripts."""
    status = now.status
    overrides = dict(zip(("feed", "rapid", "spindle"), now.overrides, strict=True)) if now.overrides else None
    return {
        "target": target,
        "state": status.state,
        "substate": status.substate,
        "work_position": position_json(now.wpos),
        "machine_position": position_json(now.mpos),
        "work_offset": position_json(now.wco),
        "feed": status.feed,
        "spindle": status.speed,
        "overrides_pct": overrides,
        "accessories": now.accessories,
        "pins": status.pins,
        "line": status.line,
        "planner_free": status.planner_free,
        "rx_free": status.rx_free,
    }
