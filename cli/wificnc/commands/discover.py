"""`wificnc discover`: controllers in this network."""

from __future__ import annotations

import sys
from dataclasses import asdict

import rich_click as click

from wificnc import ui
from wificnc.commands._finite import FiniteRange
from wificnc.commands._qr import show_qr
from wificnc.commands._target import json_option
from wificnc.connection.discover import discover
from wificnc.errors import Exit


@click.command()
@click.option("--seconds", type=FiniteRange(0.1, 60), default=2.0, show_default=True, help="How long to listen.")
@click.option("--qr/--no-qr", default=None, help="A QR code of each page, for a phone; default: in a terminal.")
@json_option
def command(seconds: float, qr: bool | None, as_json: bool) -> None:
    """Find controllers in this network, by multicast DNS. Exit code 1 if none is found."""
    found = discover(seconds)
    if as_json:
        ui.emit_json([{**asdict(one), "target": one.target, "page": one.page} for one in found])
    for one in found if not as_json else []:
        click.echo(f"{one.name:<16} {one.target:<28} {one.text.get('wificnc', '')}")
        if sys.stdout.isatty() if qr is None else qr:
            show_qr(f"page, {one.page}", one.page)
    if not found:
        ui.note(
            "no controller has answered; controllers on another network, or behind a switch that blocks multicast, "
            "are not found"
        )
    raise SystemExit(Exit.OK if found else Exit.JOB)
