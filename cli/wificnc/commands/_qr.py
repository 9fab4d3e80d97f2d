"""QR codes in a terminal."""

from __future__ import annotations

import sys

import rich_click as click

from wificnc import ui


def show_qr(title: str, text: str) -> None:
    try:
        import segno
    except ImportError:
        ui.note("`pip install segno` to print a QR code here")
        return
    click.echo(f"{title}:")
    segno.make(text).terminal(out=sys.stdout, compact=True)
