"""`wificnc dev page`: the page that the firmware of an ESP32 carries, for its compiler."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.header import write_if_changed
from wificnc.commands._output import OutputFile
from wificnc.errors import UserError
from wificnc.firmware.page_header import EmbeddedFile, embedded_files, page_header_text
from wificnc.output import STDOUT, write_stdout


@click.command()
@click.option("-o", "--output", type=OutputFile(makes_folders=True), required=True,
              help="Written only if it changes; - is stdout.")  # fmt: skip
@click.option("--board", metavar="ID", help="Board of the firmware: the pictures of others are left out.")
def command(output: Path, board: str | None) -> None:
    """Generate page_files.h, with which a firmware carries the built page (`make web`) and serves it at port 80.

    Without a built page the firmware reports that it has none.
    """
    files: list[EmbeddedFile] = []
    try:
        files = embedded_files(board=board)
    except UserError as error:
        ui.warn(f"{error}: the firmware is built without the web page ({error.hint})")
    text = page_header_text(files)
    if output == STDOUT:
        write_stdout(text.encode())
        return
    wrote = write_if_changed(output, text)
    kilobytes = sum(file.size for file in files) / 1024
    ui.note(f"{'wrote' if wrote else 'unchanged:'} {output}: {len(files)} files, {kilobytes:.0f} KB of flash")
