"""`wificnc pins`: the header the firmware of a board is built with."""

from __future__ import annotations

import sys
from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.load import load_board


@click.command()
@click.argument("board_ref", metavar="BOARD")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write to a file, only if it changes.")
def command(board_ref: str, output: Path | None) -> None:
    """Generate pin_config.h of BOARD, a board's id or the path of its TOML file."""
    text = pin_header_text(load_board(board_ref))
    if output is None:
        sys.stdout.write(text)
    else:
        ui.note(f"{'wrote' if write_if_changed(output, text) else 'unchanged:'} {output}")
