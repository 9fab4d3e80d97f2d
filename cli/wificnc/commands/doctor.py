"""`wificnc doctor`: what is here, and how to get what is not."""

from __future__ import annotations

from dataclasses import asdict

import rich_click as click

from wificnc import ui
from wificnc.commands._target import json_option
from wificnc.doctor import Doctor, Finding
from wificnc.errors import Exit

MARKS = {"good": "[green]✓[/]", "missing": "[yellow]–[/]", "wrong": "[red]✗[/]"}


@click.command()
@json_option
def command(as_json: bool) -> None:
    """Look at Python, compilers, PlatformIO, esptool, Node.js and serial ports.

    Prints the command that installs what is missing on this system.

    Exit code 1 when something is wrong; what is only missing keeps some commands from working.
    """
    findings = Doctor().examine()
    if as_json:
        ui.emit_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            show(finding)
    raise SystemExit(Exit.JOB if any(finding.verdict == "wrong" for finding in findings) else Exit.OK)


def show(finding: Finding) -> None:
    needed = f"  (needed for: {finding.needed_for})" if finding.needed_for else ""
    ui.data.print(f"{MARKS[finding.verdict]} {finding.name:<26}", end="")
    ui.data.print(f"{finding.found}{needed}", markup=False)
    if finding.fix:
        ui.data.print(f"  {'':<26}", end="")
        ui.data.print(finding.fix, style="blue", markup=False)
