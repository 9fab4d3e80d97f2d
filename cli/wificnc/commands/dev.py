"""`wificnc dev`: what builds of a firmware call."""

from __future__ import annotations

import rich_click as click

from wificnc.commands import page, pins, signing_key


@click.group(short_help="What the builds call: headers made from a board, the page and a key.")
def command() -> None:
    """What the builds call: headers made from a board, the page and a key."""


command.add_command(pins.command, "pins")
command.add_command(page.command, "page")
command.add_command(signing_key.command, "signing-key")
