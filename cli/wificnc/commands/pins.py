"""`wificnc dev pins`: the header the firmware of a board is built with."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.load import load_board
from wificnc.commands._output import OutputFile
from wificnc.output import STDOUT, write_stdout


@click.command()
@click.argument("board_ref", metavar="BOARD")
@click.option("-o", "--output", type=OutputFile(makes_folders=True), default=STDOUT,
              help="Write to a file, only if it changes; - is stdout, the default.")  # fmt: skip
def command(board_ref: str, output: Path) -> None:
    """Generate pin_config.h of BOARD, a board's id or the path of its TOML file."""
    text = pin_header_text(load_board(board_ref))
    if output == STDOUT:
        write_stdout(text.encode())
    else:
        ui.note(f"{'wrote' if write_if_changed(output, text) else 'unchanged:'} {output}")
