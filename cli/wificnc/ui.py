"""The only module that talks to the terminal: data goes to stdout, talk to stderr."""

from __future__ import annotations

import json
import sys
from typing import Any

from rich.console import Console
from rich.markup import escape

from wificnc.errors import UserError

talk = Console(stderr=True, highlight=False)
data = Console(highlight=False, soft_wrap=True)


def error(err: UserError) -> None:
    """Red title, then the way out."""
    talk.print(f"[bold red]error:[/] {escape(err.message)}", soft_wrap=True)
    if err.hint:
        talk.print(f"[blue]hint:[/] {escape(err.hint)}", soft_wrap=True)


def warn(message: str) -> None:
    talk.print(f"[bold yellow]warning:[/] {escape(message)}", soft_wrap=True)


def note(message: str) -> None:
    talk.print(f"[dim]{escape(message)}[/]", soft_wrap=True)


def emit_json(value: Any) -> None:
    """One JSON document on stdout, for scripts."""
    json.dump(value, sys.stdout, indent=2, ensure_ascii=False)
    sys.stdout.write("\n")
