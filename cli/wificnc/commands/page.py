"""`wificnc page`: the page that the firmware of an ESP32 carries, for its compiler."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.header import write_if_changed
from wificnc.errors import UserError
from wificnc.web.embed import EmbeddedFile, embedded_files, page_header_text


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Written only if it changes.")
def command(output: Path) -> None:
    """Generate page_files.h, with which a firmware carries the built page (`make web`) and serves it at port 80.

    Without a built page the firmware serves none, and says so.
    """
    files: list[EmbeddedFile] = []
    try:
        files = embedded_files()
    except UserError as error:
        ui.warn(f"{error}: the firmware will serve none ({error.hint})")
    wrote = write_if_changed(output, page_header_text(files))
    kilobytes = sum(file.size for file in files) / 1024
    ui.note(f"{'wrote' if wrote else 'unchanged:'} {output}: {len(files)} files, {kilobytes:.0f} KB of flash")
