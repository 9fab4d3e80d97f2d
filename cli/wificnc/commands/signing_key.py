"""`wificnc dev signing-key`: the public key that the firmware of an ESP32 carries, for its compiler."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.header import write_if_changed
from wificnc.build.signing import key_header_text, signing_key
from wificnc.commands._output import OutputFile
from wificnc.output import STDOUT, write_stdout


@click.command()
@click.option("-o", "--output", type=OutputFile(makes_folders=True), required=True,
              help="Written only if it changes; - is stdout.")  # fmt: skip
def command(output: Path) -> None:
    """Generate signing_key.h, the public key with which a firmware checks its updates over the network.

    It is that of $WIFICNC_SIGNING_KEY, a PEM file or its text, else of your own key, which the first build makes.
    """
    key = signing_key()
    text = key_header_text(key)
    if output == STDOUT:
        write_stdout(text.encode())
        return
    ui.note(f"{'wrote' if write_if_changed(output, text) else 'unchanged:'} {output}: key {key.name}")
