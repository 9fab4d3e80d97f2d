"""`wificnc status`: position and state of a machine, and why it does not work."""

from __future__ import annotations

from typing import Any

import rich_click as click
from rich.markup import escape
from rich.table import Table

from wificnc import ui
from wificnc.commands._target import json_option, position_json, target_option
from wificnc.connection.client import Snapshot, connected
from wificnc.connection.condition import Condition
from wificnc.connection.grbl import Status
from wificnc.live import STATE_STYLES, place

PINS = {
    "P": "probe", "D": "door", "R": "reset", "H": "feed hold", "S": "cycle start",
    "T": "M1 stops (0x88)",
    **{axis: f"limit {axis}" for axis in "XYZABC"},
}  # fmt: skip
ACCESSORIES = {"S": "spindle clockwise", "C": "spindle counter-clockwise", "F": "flood coolant", "M": "mist coolant"}


@click.command()
@target_option
@json_option
def command(target: str, as_json: bool) -> None:
    """Show position and state of a machine, and why it is locked or held. Works at any time, also while a job runs."""
    with connected(target) as client:
        now = client.look_fully()
        found = client.condition()
        commander = client.commander()
        login = client.login_hint() if client.is_locked_out() else ""
    if as_json:
        found_json = {"why": found.why, "next": found.next, "commanded_by": commander, "logged_in": not login}
        ui.emit_json({**status_json(target, now), **found_json})
        return
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    table.add_row("state", f"[{STATE_STYLES.get(now.status.state, 'default')}]{now.state}[/]")
    for name, text in [*access_rows(login), *condition_rows(found, commander), *status_rows(now)]:
        table.add_row(name, text)
    ui.data.print(table)


def access_rows(login: str) -> list[tuple[str, str]]:
    """That the controller takes no commands before a login. login: how to log in; "" if that is not needed"""
    if not login:
        return []
    return [("access", "locked: before a login you can look, hold and stop only"), ("log in", escape(login))]


def condition_rows(found: Condition, commander: str | None) -> list[tuple[str, str]]:
    """Why the machine does not take commands, and what leads on."""
    rows = [("why", found.why), ("next", found.next), ("commanded by", commander or "")]
    return [(name, escape(text)) for name, text in rows if text]


def homed_words(now: Snapshot) -> str:
    """ "Z; not homed: X Y", "all axes"; "" when the controller does not report it."""
    whole, _, mask = now.homed.partition(",")
    if whole == "1":
        return "all axes"
    if not mask.isdigit():
        return ""
    axes = "XYZABC"[: len(now.mpos)]
    homed = [axis for bit, axis in enumerate(axes) if int(mask) >> bit & 1]
    return f"{' '.join(homed) or 'none'}; not homed: {' '.join(axis for axis in axes if axis not in homed)}"


def spindle_words(status: Status) -> str:
    """ "12000", "12000, measured 11950, 3.1 A"."""
    words = [f"{status.speed:g}"]
    words += [] if status.measured is None else [f"measured {status.measured:g}"]
    words += [] if status.ampere is None else [f"{status.ampere:g} A"]
    return ", ".join(words)


def status_rows(now: Snapshot) -> list[tuple[str, str]]:
    """The fields of the report, in words; nothing for those that it leaves out."""
    status = now.status
    rows = [("work", place(now.wpos)), ("machine", place(now.mpos))]
    if words := homed_words(now):
        rows.append(("homed", words))
    if status.feed is not None:
        rows.append(("feed", f"{status.feed:g}"))
    if status.speed is not None:
        rows.append(("spindle", spindle_words(status)))
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
    """The document of --json; null is what the controller does not report. The keys are a contract with scripts."""
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
        "spindle_measured": status.measured,
        "spindle_ampere": status.ampere,
        "overrides_pct": overrides,
        "accessories": now.accessories,
        "pins": status.pins,
        "line": status.line,
        "planner_free": status.planner_free,
        "rx_free": status.rx_free,
    }
